// Reads a code of a square from the packed bytes.
// In: voxels[], the bytes of blocks as in the file. Mirrors trip_square_codes() in stream/block.c.

// Returns code number k of the codes at byte `from`. Codes are stored as differences from the
// minimum in the low half of min_width.
uint code_at(uint from, uint min_width, uint k)
{
    uint width = min_width >> 16, at = 8u * (from & 3u) + width * k;
    uint word = from >> 2, shift = at & 31u;
    if (width == 0u) // all codes equal the minimum
        return min_width;
    uint bits = voxels[word + (at >> 5)] >> shift;
    if (shift + width > 32u)
        bits |= voxels[word + (at >> 5) + 1u] << (32u - shift);
    return (min_width & 0xffffu) + (bits & ((1u << width) - 1u));
}
