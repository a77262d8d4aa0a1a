/* Reads grids of points of OpenVDB leaf by leaf. The file holds the tree, then sections for all
 * leaves:
 * - the attributes of each leaf
 * - the sizes of the pages of each attribute
 * - the voxels of each leaf
 * - the pages of each attribute
 *
 * A cursor follows each section. Memory holds 12 bytes for each leaf of up to 512 voxels, and a
 * page of each attribute. */
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include <openvdb/math/QuantizedUnitVec.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointDataGrid.h>

#include "module.h"
#include "report.h"
#include "vdb_file.h"
#include "vdb_transform.h"
#include "vdb_tree_check.h"

namespace
{

constexpr uint32_t name_limit = 4096;
constexpr uint64_t attributes_limit = 256;
constexpr int64_t page_limit = 1 << 28; /* bytes of a page */
constexpr int64_t ratio_limit = 1024;   /* Blosc compresses less than this */
constexpr int voxels = 512;             /* of a leaf */
constexpr int voxel_bytes = 4 * voxels;

/* The values of an attribute that are read. */
enum class Meaning { none, position, radius, colour, normal, intensity };

struct Attribute {
    std::string name, type, codec;
    Meaning meaning = Meaning::none;
    int numbers = 0;    /* of a value: 1 or 3 */
    uint64_t bytes = 0; /* of a stored value */
    bool paged = false, known = false;
    int64_t sizes_at = 0, pages_at = 0; /* in the file */
};

/* The part of an attribute in a leaf. */
struct Piece {
    uint64_t bytes; /* in its page, or in the file */
    uint32_t count; /* of values */
    bool uniform, paged;
};

/* The place in the sections of an attribute. */
struct Cursor {
    std::unique_ptr<trip_vdb_stream> sizes, pages;
    std::vector<char> page, piece;
    size_t used = 0;
    const char *values = nullptr; /* of this leaf */
    bool uniform = false;
};

struct State {
    State(const char *file) : path(file), fd(file)
    {
    }
    std::string path;
    trip_vdb_fd fd;
    openvdb::math::Transform::Ptr transform;
    std::vector<openvdb::Coord> origins; /* of the leaves */
    std::vector<Attribute> attributes;
    int64_t pieces_at = 0, voxels_at = 0;

    size_t leaf = 0; /* the next one */
    std::unique_ptr<trip_vdb_stream> pieces, leaves;
    std::vector<Cursor> cursors;
    uint32_t ends[voxels]; /* of the points of each voxel of this leaf */
    uint32_t count = 0, next = 0, voxel = 0;
};

template <typename Body> int guard(const std::string &path, const Body &body)
try {
    return body();
} catch (const trip_vdb_error &e) {
    return trip_fail(e.status, "read", path.c_str(), "%s", e.what());
} catch (const std::bad_alloc &) {
    return trip_fail(TRIP_ERROR, "read", path.c_str(), "out of memory for its points");
} catch (const std::exception &e) {
    return trip_fail(TRIP_ERROR, "read", path.c_str(), "is corrupt or unsupported: %s", e.what());
}

/* ---- the tree ---- */

using Tree = openvdb::points::PointDataTree;

template <typename NodeT>
void walk_node(trip_vdb_stream &is, const openvdb::Coord &origin, std::vector<openvdb::Coord> &out)
{
    if constexpr (NodeT::LEVEL == 0) {
        is.skip(NodeT::SIZE / 8);
        out.push_back(origin);
    } else {
        using Child = typename NodeT::ChildNodeType;
        typename NodeT::NodeMaskType children, values;
        children.load(is);
        values.load(is);
        trip_vdb_tree_check<Tree>::skip_values(is, (openvdb::Index)NodeT::NUM_VALUES, values,
                                               false);
        for (auto child = children.beginOn(); child; ++child) {
            openvdb::Coord at;
            NodeT::offsetToLocalCoord(child.pos(), at);
            for (int a = 0; a < 3; a++)
                at[a] = origin[a] + at[a] * (int32_t)Child::DIM;
            walk_node<Child>(is, at, out);
        }
    }
}

/* Collects the origins of the leaves and moves behind the tree. */
void walk_tree(trip_vdb_stream &is, std::vector<openvdb::Coord> &out)
{
    using Top = Tree::RootNodeType::ChildNodeType;
    const int64_t begin = is.tellg();
    trip_vdb_tree_check<Tree> check(is, false); /* of the values that are used below */
    is.seekg(begin);
    is.skip(4 + 4); /* buffers of a leaf, and the background */
    const uint32_t tiles = is.get_value<uint32_t>(), children = is.get_value<uint32_t>();
    is.skip((int64_t)tiles * (12 + 4 + 1));
    out.reserve(check.leaves);
    for (uint32_t i = 0; i < children; i++) {
        openvdb::Coord origin;
        for (int a = 0; a < 3; a++)
            origin[a] = is.get_value<int32_t>();
        walk_node<Top>(is, origin, out);
    }
}

/* ---- attributes ---- */

[[noreturn]] void corrupt(const char *what)
{
    throw trip_vdb_error(std::string("is corrupt: ") + what);
}

/* Sets the bytes of a stored value, if the type and the codec are known. */
void find_storage(Attribute &a)
{
    const bool three = a.type == "vec3s" || a.type == "vec3d";
    const bool real = three || a.type == "float" || a.type == "double";
    const uint64_t wide = a.type == "vec3d" || a.type == "double" ? 8 : 4;
    a.numbers = three ? 3 : 1;
    const uint64_t n = (uint64_t)a.numbers;
    if (real && a.codec == "null")
        a.bytes = n * wide;
    else if (real && (a.codec == "trnc" || a.codec == "fxpt16" || a.codec == "ufxpt16"))
        a.bytes = n * 2;
    else if (real && (a.codec == "fxpt8" || a.codec == "ufxpt8"))
        a.bytes = n;
    else if (three && a.codec == "uvec")
        a.bytes = 2;
    a.known = a.bytes > 0;
}

Meaning meaning_of(const Attribute &a)
{
    const bool three = a.numbers == 3;
    if (a.name == "P" && three)
        return Meaning::position;
    if (a.name == "pscale" || a.name == "radius")
        return three ? Meaning::none : Meaning::radius;
    if ((a.name == "Cd" || a.name == "color") && three)
        return Meaning::colour;
    if ((a.name == "N" || a.name == "normal") && three)
        return Meaning::normal;
    return a.name == "intensity" && !three ? Meaning::intensity : Meaning::none;
}

uint64_t get_count(trip_vdb_stream &is)
{
    const uint64_t n = is.get_value<uint64_t>();
    if (n > attributes_limit)
        corrupt("it states too many attributes");
    return n;
}

/* Reads the names and types of the attributes. */
std::vector<Attribute> read_descriptor(trip_vdb_stream &is)
{
    std::vector<Attribute> out(get_count(is));
    for (Attribute &a : out) {
        a.type = is.get_string(name_limit);
        a.codec = is.get_string(name_limit);
        find_storage(a);
    }
    for (size_t i = 0; i < out.size(); i++) {
        const std::string name = is.get_string(name_limit);
        const uint64_t place = is.get_value<uint64_t>();
        if (place >= out.size())
            corrupt("a name belongs to no attribute");
        out[place].name = name;
    }
    for (uint64_t i = get_count(is); i > 0; i--) { /* groups */
        is.get_string(name_limit);
        is.skip(8);
    }
    for (uint32_t i = is.get_value<uint32_t>(); i > 0; i--) { /* metadata */
        is.get_string(name_limit);
        is.get_string(name_limit);
        is.skip(is.get_value<uint32_t>());
    }
    for (Attribute &a : out)
        a.meaning = a.known ? meaning_of(a) : Meaning::none;
    return out;
}

Piece read_piece(trip_vdb_stream &is)
{
    constexpr uint64_t head = 6; /* counted with the bytes */
    constexpr uint8_t strided = 1, uniform = 2, paged = 8, known = 15;
    Piece p = {};
    p.bytes = is.get_value<uint64_t>();
    is.skip(1);
    const uint8_t flags = is.get_value<uint8_t>();
    p.count = is.get_value<uint32_t>();
    if (p.bytes < head || p.bytes - head > (uint64_t)page_limit || flags > known)
        corrupt("an attribute has an impossible size");
    p.bytes -= head;
    p.uniform = flags & uniform;
    p.paged = flags & paged;
    if (flags & strided)
        is.skip(4);
    return p;
}

struct PageSize {
    int64_t stored, bytes;
};

PageSize read_page_size(const trip_vdb_fd &fd, trip_vdb_stream &is)
{
    PageSize p;
    p.stored = is.get_value<int32_t>();
    p.bytes = p.stored > 0 ? is.get_value<int32_t>() : -p.stored;
    if (p.bytes <= 0 || p.bytes > page_limit || p.stored > 2 * p.bytes + 1024 ||
        std::abs(p.stored) > fd.size() || (p.stored > 0 && p.bytes / ratio_limit > p.stored))
        corrupt("a page of an attribute has an impossible size");
    return p;
}

/* Finds the sections: follows the pieces of all leaves, once for each attribute. */
void find_sections(State &s, trip_vdb_stream &is)
{
    const uint16_t passes = is.get_value<uint16_t>();
    if (passes < 4 || passes % 2 != 0)
        corrupt("it has an impossible number of passes");
    is.skip(2 * (int64_t)s.origins.size());
    const uint8_t header = is.get_value<uint8_t>();
    if (header != 1)
        throw trip_vdb_error("holds leaves with different attributes, which are not read");
    s.attributes = read_descriptor(is);
    if (s.attributes.size() != (size_t)(passes - 4) / 2)
        corrupt("its number of attributes and of passes differ");
    s.pieces_at = is.tellg();
    const size_t n = s.attributes.size();
    for (size_t leaf = 0; leaf < s.origins.size(); leaf++)
        for (size_t i = 0; i < n; i++) {
            const bool paged = read_piece(is).paged;
            if (leaf > 0 && paged != s.attributes[i].paged)
                corrupt("an attribute is paged in a part of its leaves");
            s.attributes[i].paged = paged;
        }
    std::vector<int64_t> all(n, 0); /* bytes of the pages of each attribute */
    for (size_t i = 0; i < n; i++) {
        trip_vdb_stream pieces(s.fd);
        pieces.seekg(s.pieces_at);
        s.attributes[i].sizes_at = is.tellg();
        uint64_t left = 0;
        for (size_t leaf = 0; leaf < s.origins.size(); leaf++)
            for (size_t k = 0; k < n; k++) {
                const Piece p = read_piece(pieces);
                if (k != i)
                    continue;
                if (!p.paged) {
                    all[i] += (int64_t)p.bytes + (p.uniform ? 0 : 1);
                    continue;
                }
                if (left == 0) {
                    const PageSize page = read_page_size(s.fd, is);
                    left = (uint64_t)page.bytes;
                    all[i] += std::abs(page.stored);
                }
                if (p.bytes > left)
                    corrupt("a page of an attribute is too small");
                left -= p.bytes;
            }
    }
    s.voxels_at = is.tellg();
    for (size_t leaf = 0; leaf < s.origins.size(); leaf++) {
        is.skip(voxels / 8);
        const uint16_t bytes = is.get_value<uint16_t>();
        is.skip(bytes == UINT16_MAX ? voxel_bytes : bytes);
    }
    int64_t at = is.tellg();
    for (size_t i = 0; i < n; i++) {
        s.attributes[i].pages_at = at;
        at += all[i];
    }
    if (at > s.fd.size())
        throw trip_vdb_error("ends early, at byte " + std::to_string(s.fd.size()) +
                             ": truncated or corrupt");
}

/* ---- leaves ---- */

/* Decompresses Blosc. The head of the data must give their size and the expected one. */
void unpack(const char *from, int64_t stored, char *to, int64_t bytes)
{
    constexpr int64_t head = 16;
    uint32_t sizes[3] = {};
    if (stored >= head)
        std::memcpy(sizes, from + 4, sizeof sizes);
    if (stored < head || sizes[0] != bytes || sizes[2] != stored)
        corrupt("impossible compressed values");
    auto made = openvdb::compression::bloscDecompress(from, (size_t)bytes, false);
    std::memcpy(to, made.get(), (size_t)bytes);
}

void load_page(const State &s, Cursor &c)
{
    const PageSize p = read_page_size(s.fd, *c.sizes);
    c.page.resize((size_t)p.bytes);
    c.used = 0;
    if (p.stored <= 0) {
        c.pages->read(c.page.data(), p.bytes);
        return;
    }
    std::vector<char> packed((size_t)p.stored);
    c.pages->read(packed.data(), p.stored);
    unpack(packed.data(), p.stored, c.page.data(), p.bytes);
}

/* Sets c.values to the values of the next leaf. */
void load_piece(const State &s, Cursor &c, const Attribute &a, const Piece &p)
{
    const uint64_t wanted = (p.uniform ? 1 : p.count) * a.bytes;
    c.uniform = p.uniform;
    if (p.paged) {
        if (c.used == c.page.size())
            load_page(s, c);
        if (p.bytes != wanted || p.bytes > c.page.size() - c.used)
            corrupt("an attribute has an impossible size");
        c.values = c.page.data() + c.used;
        c.used += (size_t)p.bytes;
        return;
    }
    const bool packed = !p.uniform && c.pages->get_value<uint8_t>() == 1;
    if (p.bytes > (uint64_t)s.fd.size() || wanted > (uint64_t)page_limit ||
        wanted / ratio_limit > p.bytes || (!packed && p.bytes != wanted))
        corrupt("an attribute has an impossible size");
    c.piece.resize((size_t)wanted);
    if (packed) {
        std::vector<char> stored((size_t)p.bytes);
        c.pages->read(stored.data(), (int64_t)p.bytes);
        unpack(stored.data(), (int64_t)p.bytes, c.piece.data(), (int64_t)wanted);
    } else {
        c.pages->read(c.piece.data(), (int64_t)p.bytes);
    }
    c.values = c.piece.data();
}

/* Reads the ends of the points of each voxel. */
void load_voxels(State &s)
{
    char packed[UINT16_MAX];
    trip_vdb_stream &is = *s.leaves;
    is.skip(voxels / 8);
    const uint16_t bytes = is.get_value<uint16_t>();
    if (bytes == UINT16_MAX) {
        is.read((char *)s.ends, voxel_bytes);
    } else {
        is.read(packed, bytes);
        unpack(packed, bytes, (char *)s.ends, voxel_bytes);
    }
    for (int i = 0; i < voxels; i++)
        if (s.ends[i] < (i ? s.ends[i - 1] : 0) || s.ends[i] > s.count)
            corrupt("a voxel has impossible points");
    if (s.ends[voxels - 1] != s.count)
        corrupt("a leaf has points in no voxel");
}

void load_leaf(State &s)
{
    bool counted = false;
    for (size_t i = 0; i < s.attributes.size(); i++) {
        const Attribute &a = s.attributes[i];
        const Piece p = read_piece(*s.pieces);
        if (a.meaning == Meaning::none)
            continue;
        if (counted && p.count != s.count)
            corrupt("the attributes of a leaf have different lengths");
        s.count = p.count;
        counted = true;
        load_piece(s, s.cursors[i], a, p);
    }
    load_voxels(s);
    s.next = s.voxel = 0;
    s.leaf++;
}

/* Decodes a value of 1 or 3 numbers. */
void decode(const Attribute &a, const Cursor &c, uint32_t index, double out[3])
{
    const char *v = c.values + (c.uniform ? 0 : index * a.bytes);
    const uint64_t step = a.bytes / (uint64_t)a.numbers;
    if (a.codec == "uvec") {
        uint16_t bits;
        std::memcpy(&bits, v, sizeof bits);
        const openvdb::Vec3s n = openvdb::math::QuantizedUnitVec::unpack(bits);
        for (int i = 0; i < 3; i++)
            out[i] = (double)n[i];
        return;
    }
    const bool fixed = a.codec[0] == 'f' || a.codec[0] == 'u';
    for (int i = 0; i < a.numbers; i++, v += step) {
        uint16_t two = 0;
        float four;
        if (step == 8) {
            std::memcpy(&out[i], v, 8);
        } else if (step == 4) {
            std::memcpy(&four, v, 4);
            out[i] = (double)four;
        } else if (fixed) {
            std::memcpy(&two, v, step);
            out[i] = two / (step == 1 ? 255.0 : 65535.0) - (a.codec[0] == 'f' ? 0.5 : 0);
        } else {
            openvdb::math::half half;
            std::memcpy(&half, v, 2);
            out[i] = (double)(float)half;
        }
    }
}

void read_one(State &s, trip_point *out)
{
    while (s.ends[s.voxel] <= s.next)
        s.voxel++;
    const openvdb::Coord &o = s.origins[s.leaf - 1];
    const int32_t n = (int32_t)s.voxel;
    const double at[3] = { (double)(o[0] + (n >> 6)), (double)(o[1] + (n >> 3 & 7)),
                           (double)(o[2] + (n & 7)) };
    for (size_t i = 0; i < s.attributes.size(); i++) {
        const Attribute &a = s.attributes[i];
        double v[3] = {};
        if (a.meaning == Meaning::none)
            continue;
        decode(a, s.cursors[i], s.next, v);
        if (a.meaning == Meaning::radius)
            out->radius = (float)v[0];
        else if (a.meaning == Meaning::intensity)
            out->intensity = (float)v[0];
        for (int k = 0; k < 3 && a.meaning == Meaning::colour; k++)
            out->colour[k] = (float)v[k];
        for (int k = 0; k < 3 && a.meaning == Meaning::normal; k++)
            out->normal[k] = (float)v[k];
        if (a.meaning != Meaning::position)
            continue;
        const openvdb::Vec3d p =
            s.transform->indexToWorld(openvdb::Vec3d(at[0] + v[0], at[1] + v[1], at[2] + v[2]));
        for (int k = 0; k < 3; k++)
            out->position[k] = p[k];
    }
    s.next++;
}

void begin(State &s)
{
    s.leaf = 0;
    s.count = s.next = 0;
    s.pieces = std::make_unique<trip_vdb_stream>(s.fd);
    s.leaves = std::make_unique<trip_vdb_stream>(s.fd);
    s.pieces->seekg(s.pieces_at);
    s.leaves->seekg(s.voxels_at);
    s.cursors.clear();
    s.cursors.resize(s.attributes.size());
    for (size_t i = 0; i < s.attributes.size(); i++) {
        const Attribute &a = s.attributes[i];
        Cursor &c = s.cursors[i];
        if (a.meaning == Meaning::none)
            continue;
        c.sizes = std::make_unique<trip_vdb_stream>(s.fd);
        c.pages = std::make_unique<trip_vdb_stream>(s.fd);
        c.sizes->seekg(a.sizes_at);
        c.pages->seekg(a.pages_at);
    }
}

/* ---- the table ---- */

const trip_vdb_entry &find_points(const trip_vdb_contents &contents)
{
    for (const trip_vdb_entry &entry : contents.grids)
        if (entry.type == "ptdataidx32" && entry.default_tree) {
            if (!entry.parent.empty())
                throw trip_vdb_error(
                    "its points share the tree of another grid, which is not read");
            return entry;
        }
    throw trip_vdb_error("has no grid of points");
}

void describe(const State &s, const trip_vdb_contents &contents, const trip_vdb_head &head,
              const std::string &name, trip_vdb_points_info *info)
{
    std::string extras;
    bool positioned = false;
    for (const Attribute &a : s.attributes) {
        positioned = positioned || a.meaning == Meaning::position;
        info->attributes |= a.meaning == Meaning::radius      ? TRIP_POINT_RADIUS
                            : a.meaning == Meaning::colour    ? TRIP_POINT_COLOUR
                            : a.meaning == Meaning::normal    ? TRIP_POINT_NORMAL
                            : a.meaning == Meaning::intensity ? TRIP_POINT_INTENSITY
                                                              : 0;
        if (a.meaning == Meaning::none && a.codec != "grp")
            extras += (extras.empty() ? "" : ", ") + a.name;
    }
    if (!positioned)
        throw trip_vdb_error("its points lack the attribute P, or store it in an unknown way");
    snprintf(info->grid, sizeof info->grid, "%s", name.c_str());
    snprintf(info->extras, sizeof info->extras, "%s", extras.c_str());
    snprintf(info->comments, sizeof info->comments, "%s",
             (head.creator.empty() ? contents.creator : head.creator).c_str());
}

int open_points(const char *path, trip_vdb_points_info *info, void **out)
{
    return guard(path, [&] {
        static const bool initialized = (openvdb::initialize(), true);
        (void)initialized;
        auto s = std::make_unique<State>(path);
        const trip_vdb_contents contents = trip_vdb_read_contents(s->fd);
        const trip_vdb_entry &entry = find_points(contents);
        if (contents.version < openvdb::OPENVDB_FILE_VERSION_MULTIPASS_IO)
            throw trip_vdb_error("is of a version before grids of points");
        trip_vdb_stream is(s->fd);
        const trip_vdb_head head = trip_vdb_read_head(is, contents, entry);
        openvdb::io::StreamMetadata::Ptr metadata(new openvdb::io::StreamMetadata);
        metadata->setFileVersion(contents.version);
        metadata->setLibraryVersion({ contents.library[0], contents.library[1] });
        metadata->setCompression(head.compression);
        metadata->setSeekable(true);
        openvdb::io::setStreamMetadataPtr(is, metadata);
        s->transform = trip_vdb_read_transform(is);
        walk_tree(is, s->origins);
        if (s->origins.empty())
            throw trip_vdb_error("holds no points");
        find_sections(*s, is);
        *info = {};
        describe(*s, contents, head, entry.name, info);
        begin(*s);
        *out = s.release();
        return 0;
    });
}

int read_points(void *state, trip_point *out, size_t room, size_t *got_out)
{
    State &s = *(State *)state;
    *got_out = 0;
    return guard(s.path, [&] {
        while (*got_out < room) {
            while (s.next == s.count && s.leaf < s.origins.size())
                load_leaf(s);
            if (s.next == s.count)
                break;
            read_one(s, &out[(*got_out)++]);
        }
        return 0;
    });
}

int rewind_points(void *state)
{
    State &s = *(State *)state;
    return guard(s.path, [&] {
        begin(s);
        return 0;
    });
}

void close_points(void *state)
{
    delete (State *)state;
}

} // namespace

extern "C" const trip_vdb_point_reader trip_vdb_points_reader = { open_points, read_points,
                                                                  rewind_points, close_points };
