// A code of a square, as it is in the file. In: voxels[], the bytes of blocks. Mirrors
// trip_square_codes() in stream/block.c.

// Number k of those that begin at byte `from`, above the least one.
uint code_at(uint from, uint min_width, uint k)
{
    uint width = min_width >> 16, at = 8u * (from & 3u) + width * k;
    uint word = from >> 2, shift = at & 31u;
    if (width == 0u) // without bytes
        return min_width;
    uint bits = voxels[word + (at >> 5)] >> shift;
    if (shift + width > 32u)
        bits |= voxels[word + (at >> 5) + 1u] << (32u - shift);
    return (min_width & 0xffffu) + (bits & ((1u << width) - 1u));
}
