/* Checks a grid's tree in its file and computes its memory before the library builds it. The
 * library allocates the nodes of a tree of any size. It writes beyond its buffers if a chunk gives
 * a wrong size. It frees random addresses if the values of a node cannot be decompressed. The check
 * reads the values of nodes once with the library's own functions. It skips the values of leaves.
 */
#ifndef TRIP_VDB_TREE_CHECK_H
#define TRIP_VDB_TREE_CHECK_H

#include <cstdlib>
#include <memory>
#include <set>

#include <openvdb/openvdb.h>
#include <openvdb/io/Compression.h>

#include "vdb_file.h"

/* Coordinates beyond this limit would make a box span more than 32 bits. */
constexpr int32_t trip_vdb_far = 1 << 30;

template <typename TreeT> class trip_vdb_tree_check
{
  public:
    /* `is` must be positioned at the tree and have the file's version and compression as metadata.
     * The check moves it past the tree's nodes, to the leaves' values. */
    trip_vdb_tree_check(trip_vdb_stream &is, bool as_half) : is_(is), half_(as_half)
    {
        if (is_.get_value<int32_t>() != 1)
            throw trip_vdb_error(
                "has several buffers per leaf, an obsolete format that cannot be read");
        check_root();
    }

    /* Memory of the tree without its leaves' values. */
    uint64_t bytes = 0;
    uint64_t leaves = 0;

  private:
    using ValueT = typename TreeT::ValueType;
    using LeafT = typename TreeT::LeafNodeType;
    using TopT = typename TreeT::RootNodeType::ChildNodeType;
    static constexpr uint64_t heap_bytes = 16; /* around every node */

    void check_root()
    {
        check_value();
        uint32_t tiles = is_.get_value<uint32_t>(), children = is_.get_value<uint32_t>();
        for (uint32_t i = 0; i < tiles; i++) {
            check_origin();
            check_value();
            if ((unsigned char)is_.get_value<char>() > 1)
                throw trip_vdb_error("is corrupt: a tile is neither active nor inactive");
        }
        for (uint32_t i = 0; i < children; i++) {
            check_origin();
            check_node<TopT>();
        }
    }

    void check_value()
    {
        if constexpr (std::is_same<ValueT, bool>::value) {
            if ((unsigned char)is_.get_value<char>() > 1)
                throw trip_vdb_error("is corrupt: a truth value is neither true nor false");
        } else {
            is_.get_value<ValueT>();
        }
    }

    void check_origin()
    {
        openvdb::Coord origin;
        for (int a = 0; a < 3; a++) {
            origin[a] = is_.get_value<int32_t>();
            if (origin[a] < -trip_vdb_far || origin[a] >= trip_vdb_far)
                throw trip_vdb_error("has voxels at coordinate " + std::to_string(origin[a]) +
                                     "; the limit is 2^30");
            if (origin[a] % (int32_t)TopT::DIM != 0)
                throw trip_vdb_error("is corrupt: a node begins at coordinate " +
                                     std::to_string(origin[a]));
        }
        if (!origins_.insert(origin).second)
            throw trip_vdb_error("is corrupt: a part of the tree occurs twice");
        bytes += sizeof(openvdb::Coord) + 64; /* an entry of the root's table */
    }

    template <typename NodeT> void check_node()
    {
        bytes += sizeof(NodeT) + heap_bytes;
        if constexpr (NodeT::LEVEL == 0) {
            leaves++;
            is_.skip(NodeT::SIZE / 8); /* the leaf's mask */
        } else {
            typename NodeT::NodeMaskType children, values;
            children.load(is_);
            values.load(is_);
            bool old = openvdb::io::getFormatVersion(is_) <
                       openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION;
            check_values(old ? children.countOff() : (openvdb::Index)NodeT::NUM_VALUES, values);
            for (auto child = children.beginOn(); child; ++child)
                check_node<typename NodeT::ChildNodeType>();
        }
    }

  public:
    /* Skips `count` stored values. Throws if the size of their chunk is impossible. */
    template <typename MaskT>
    static void skip_values(trip_vdb_stream &is, openvdb::Index count, const MaskT &mask,
                            bool as_half)
    {
        check_masking(is);
        openvdb::io::readCompressedValues<ValueT>(is, nullptr, count, mask, as_half);
        check_chunk(is, count * sizeof(ValueT));
    }

    /* Checks the size of the chunk just skipped, which holds at most `bytes` uncompressed bytes. */
    static void check_chunk(trip_vdb_stream &is, uint64_t bytes)
    {
        namespace io = openvdb::io;
        uint32_t compression = io::getDataCompression(is);
        int64_t stored = is.chunk_bytes(), start = is.chunk_start(), end = is.tellg();
        if (!(compression & (io::COMPRESS_BLOSC | io::COMPRESS_ZIP)) || stored <= 0 ||
            start + stored != end)
            return;
        bool fits = (uint64_t)stored <= 2 * bytes + 1024;
        if (fits && compression & io::COMPRESS_BLOSC)
            fits = is_blosc_chunk(is, start, stored);
        if (!fits)
            throw trip_vdb_error("is corrupt: impossible compressed values at byte " +
                                 std::to_string(start));
    }

  private:
    /* Refuses masked values in a grid without masked values. The library reads such values from
     * another byte than it skips to. */
    static void check_masking(trip_vdb_stream &is)
    {
        namespace io = openvdb::io;
        if (io::getFormatVersion(is) < openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION ||
            io::getDataCompression(is) & io::COMPRESS_ACTIVE_MASK)
            return;
        if (is.peek() != io::NO_MASK_AND_ALL_VALS)
            throw trip_vdb_error("is corrupt: masked values at byte " +
                                 std::to_string((int64_t)is.tellg()) + " of an unmasked grid");
    }

    /* Returns whether the size in the Blosc header matches the chunk. The library does not check
     * it. */
    static bool is_blosc_chunk(trip_vdb_stream &is, int64_t start, int64_t stored)
    {
        if (stored < 16)
            return false;
        is.seekg(start + 12);
        bool same = is.get_value<uint32_t>() == (uint64_t)stored;
        is.seekg(start + stored);
        return same;
    }

    /* Skips the values first, which checks the size of their chunk. */
    template <typename MaskT> void check_values(openvdb::Index count, const MaskT &mask)
    {
        int64_t start = is_.tellg();
        skip_values(is_, count, mask, half_);
        is_.seekg(start);
        std::unique_ptr<ValueT[]> values(new ValueT[count]);
        openvdb::io::readCompressedValues(is_, values.get(), count, mask, half_);
    }

    trip_vdb_stream &is_;
    bool half_;
    std::set<openvdb::Coord> origins_;
};

#endif
