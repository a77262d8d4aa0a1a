#include "vdb_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <openvdb/openvdb.h>

#include "vdb_tree_check.h"

namespace
{

namespace io = openvdb::io;
using openvdb::Coord;
using openvdb::CoordBBox;

constexpr int32_t box_voxels = 64;

/* The density of a stored value, and whether the voxel exists. */
struct Sample {
    float value;
    bool exists;
};

class Converter
{
  public:
    Converter() = default;
    Converter(const trip_vdb_conversion &c, double background)
        : mode_(c.mode),
          scale_(1 / (c.mode == TRIP_LEVEL_SET_BAND ? background
                                                    : std::min(6 * c.voxel_world, 2 * background)))
    {
    }
    Sample operator()(double stored, bool active) const
    {
        if (mode_ == TRIP_LEVEL_SET_BAND)
            return { (float)std::max(0.0, 1 - std::fabs(stored) * scale_), active };
        if (mode_ == TRIP_LEVEL_SET_FILLED) {
            double t = std::min(1.0, std::max(0.0, 0.5 - stored * scale_));
            float inside = (float)(t * t * (3 - 2 * t));
            return { inside, inside > 0 };
        }
        return { (float)stored, active };
    }
    bool fills() const
    {
        return mode_ == TRIP_LEVEL_SET_FILLED;
    }

  private:
    trip_level_set_mode mode_ = TRIP_LEVEL_SET_UNSET;
    double scale_ = 1;
};

/* The part of a decoded box in one node, and the arrays of the box. */
struct Part {
    CoordBBox box;
    const int64_t *lo, *size;
    float *values;
    uint8_t *active;

    template <typename Get> void fill(const Get &get) const
    {
        for (int32_t z = box.min().z(); z <= box.max().z(); z++)
            for (int32_t y = box.min().y(); y <= box.max().y(); y++) {
                int64_t at = ((z - lo[2]) * size[1] + (y - lo[1])) * size[0] - lo[0];
                for (int32_t x = box.min().x(); x <= box.max().x(); x++) {
                    Sample s = get(x, y, z);
                    if (!s.exists)
                        continue;
                    values[at + x] = s.value;
                    if (active)
                        active[at + x] = 1;
                }
            }
    }
};

/* Collects the boxes of a grid. */
class BoxList
{
  public:
    BoxList(trip_vdb_grid &grid, trip_budget *budget) : grid_(grid), budget_(budget)
    {
    }
    /* Adds the boxes of a full node or tile. */
    void add_full(const CoordBBox &box)
    {
        include(box);
        for (int32_t z = box.min().z(); z <= box.max().z(); z += box_voxels)
            for (int32_t y = box.min().y(); y <= box.max().y(); y += box_voxels)
                for (int32_t x = box.min().x(); x <= box.max().x(); x += box_voxels)
                    add(CoordBBox(x, y, z, x + box_voxels - 1, y + box_voxels - 1,
                                  z + box_voxels - 1));
    }
    void add(const CoordBBox &box)
    {
        if ((grid_.boxes.size() + 1) * 2 * sizeof(trip_vdb_box) > trip_budget_left_bytes(budget_))
            throw trip_vdb_error("has too many voxels: more than " +
                                 std::to_string(grid_.boxes.size()) +
                                 " boxes do not fit in memory: raise "
                                 "--memory");
        trip_vdb_box b;
        for (int a = 0; a < 3; a++) {
            b.lo[a] = box.min()[a];
            b.size[a] = (uint8_t)(box.max()[a] - box.min()[a] + 1);
        }
        grid_.boxes.push_back(b);
    }
    /* Extends the bounds of the existing voxels. */
    void include(const CoordBBox &box)
    {
        bounds_.expand(box);
    }
    void finish();

  private:
    trip_vdb_grid &grid_;
    trip_budget *budget_;
    CoordBBox bounds_;
};

/* Clips the boxes to the bounds and sorts them. */
void BoxList::finish()
{
    std::vector<trip_vdb_box> &boxes = grid_.boxes;
    auto clip = [&](trip_vdb_box &b) {
        for (int a = 0; a < 3; a++) {
            int32_t lo = std::max(b.lo[a], bounds_.min()[a]);
            int32_t hi = std::min(b.lo[a] + (b.size[a] - 1), bounds_.max()[a]);
            if (hi < lo)
                return true;
            b.lo[a] = lo;
            b.size[a] = (uint8_t)(hi - lo + 1);
        }
        return false;
    };
    boxes.erase(std::remove_if(boxes.begin(), boxes.end(), clip), boxes.end());
    if (boxes.empty())
        throw trip_vdb_error("contains a grid without active voxels");
    std::sort(boxes.begin(), boxes.end(), [](const trip_vdb_box &a, const trip_vdb_box &b) {
        for (int axis = 2; axis > 0; axis--)
            if (a.lo[axis] != b.lo[axis])
                return a.lo[axis] < b.lo[axis];
        return a.lo[0] < b.lo[0];
    });
    for (int a = 0; a < 3; a++) {
        grid_.lo[a] = std::max(bounds_.min()[a], INT32_MIN + 1) - 1;
        grid_.hi[a] = std::min(bounds_.max()[a], INT32_MAX - 1) + 1;
    }
}

/* Return the first and the last set bit of a byte that is not 0. */
int32_t first_bit(unsigned byte)
{
    return __builtin_ctz(byte);
}

int32_t last_bit(unsigned byte)
{
    return 31 - __builtin_clz(byte);
}

/* Returns the bounds of the set bits of a leaf's mask, relative to the leaf. Voxel (x, y, z) is bit
 * z + 8 y + 64 x: each x has a word of 64 bits, with a byte for each y. */
template <typename MaskT> CoordBBox mask_bounds(const MaskT &mask)
{
    uint64_t any = 0;
    unsigned xs = 0, ys = 0, zs = 0;
    for (unsigned x = 0; x < 8; x++) {
        uint64_t word = mask.template getWord<uint64_t>(x);
        any |= word;
        xs |= (unsigned)(word != 0) << x;
    }
    for (unsigned y = 0; y < 8; y++) {
        unsigned byte = any >> (8 * y) & 0xff;
        zs |= byte;
        ys |= (unsigned)(byte != 0) << y;
    }
    if (any == 0)
        return CoordBBox();
    return CoordBBox(first_bit(xs), first_bit(ys), first_bit(zs), last_bit(xs), last_bit(ys),
                     last_bit(zs));
}

template <typename TreeT> class TypedGrid : public trip_vdb_grid
{
  public:
    TypedGrid(const trip_vdb_fd &fd, trip_vdb_stream &is, bool as_half,
              const trip_vdb_conversion &conversion, trip_budget *budget)
        : fd_(fd), half_(as_half)
    {
        int64_t start = is.tellg();
        trip_vdb_tree_check<TreeT> check(is, as_half);
        reserved_tree_.take(budget, check.bytes + check.leaves * sizeof(int64_t),
                            "its tree without values");
        leaf_offsets_.reserve(check.leaves);
        is.seekg(start);
        read_tree(is);
        read_leaves(is);
        stream_ = *io::getStreamMetadataPtr(is);
        stream_.setSeekable(false);
        stream_.setBackgroundPtr(&root_.background());
        set_conversion(conversion);
        collect(budget);
        reserved_boxes_.take(budget, boxes.capacity() * sizeof boxes[0], "its list of boxes");
    }

    void decode(const int64_t at[3], const int64_t size[3], float *values,
                uint8_t *active) const override
    {
        size_t count = (size_t)(size[0] * size[1] * size[2]);
        std::fill(values, values + count, (float)background);
        if (active)
            std::fill(active, active + count, (uint8_t)0);
        CoordBBox box;
        for (int a = 0; a < 3; a++) {
            box.min()[a] = (int32_t)std::max<int64_t>(at[a], lo[a]);
            box.max()[a] = (int32_t)std::min<int64_t>(at[a] + size[a] - 1, hi[a]);
        }
        if (!box.empty())
            decode_leaves(Part{ box, at, size, values, active });
    }

  private:
    using ValueT = typename TreeT::ValueType;
    using LeafT = typename TreeT::LeafNodeType;
    using TopT = typename TreeT::RootNodeType::ChildNodeType;
    using MiddleT = typename TopT::ChildNodeType;
    /* Leaves of truth values are bits and stay in memory with the tree. */
    static constexpr bool in_memory = std::is_same<ValueT, bool>::value;

    /* Reads the root here, since the library's function leaks a node that turns out to be corrupt.
     */
    void read_tree(trip_vdb_stream &is)
    {
        is.get_value<int32_t>(); /* number of buffers, already checked */
        root_.setBackground(is.get_value<ValueT>(), false);
        io::setGridBackgroundValuePtr(is, &root_.background());
        openvdb::Index tiles = is.get_value<openvdb::Index>();
        openvdb::Index children = is.get_value<openvdb::Index>();
        for (openvdb::Index i = 0; i < tiles; i++) {
            Coord origin = is.get_value<Coord>();
            ValueT value = is.get_value<ValueT>();
            root_.addTile(origin, value, is.get_value<bool>());
        }
        for (openvdb::Index i = 0; i < children; i++) {
            auto child = std::make_unique<TopT>(openvdb::PartialCreate(), is.get_value<Coord>(),
                                                root_.background());
            TopT *node = child.release(); /* unreadable, it cannot be freed: see vdb_tree_check.h */
            node->readTopology(is, half_);
            root_.addChild(node);
        }
    }

    /* Stores the offset of each leaf and checks that it can be read. Reads leaves that stay in
     * memory. */
    void read_leaves(trip_vdb_stream &is)
    {
        if constexpr (in_memory) {
            root_.readBuffers(is, half_);
        } else {
            for (auto top = root_.beginChildOn(); top; ++top)
                for (auto middle = top->beginChildOn(); middle; ++middle)
                    for (auto leaf = middle->beginChildOn(); leaf; ++leaf) {
                        leaf->setTransientData((openvdb::Index32)leaf_offsets_.size());
                        leaf_offsets_.push_back(is.tellg());
                        skip_leaf(is, *leaf);
                    }
        }
    }

    void skip_leaf(trip_vdb_stream &is, const LeafT &leaf)
    {
        typename LeafT::NodeMaskType mask;
        mask.load(is);
        if (mask != leaf.valueMask())
            throw trip_vdb_error("is corrupt: a leaf's two masks differ");
        if (io::getFormatVersion(is) < openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION) {
            is.skip(3 * sizeof(int32_t)); /* its origin, repeated */
            if (is.get_value<int8_t>() != 1)
                throw trip_vdb_error(
                    "has several buffers per leaf, an obsolete format that cannot be read");
        }
        trip_vdb_tree_check<TreeT>::skip_values(is, LeafT::SIZE, mask, half_);
    }

    void set_conversion(const trip_vdb_conversion &conversion)
    {
        double stored = (double)root_.background();
        bool converts = conversion.mode != TRIP_LEVEL_SET_UNSET;
        if (converts && !(stored > 0 && std::isfinite(stored)))
            throw trip_vdb_error("is a level set with a band of zero width");
        convert_ = Converter(conversion, stored);
        background = !converts && std::isfinite((float)stored) ? stored : 0;
    }

    void collect(trip_budget *budget)
    {
        BoxList list(*this, budget);
        for (auto tile = root_.cbeginValueAll(); tile; ++tile)
            if (tile_exists(*tile, tile.isValueOn()))
                list.add_full(CoordBBox::createCube(tile.getCoord(), TopT::DIM));
        for (auto top = root_.cbeginChildOn(); top; ++top) {
            for (auto tile = top->cbeginValueAll(); tile; ++tile)
                if (tile_exists(*tile, tile.isValueOn()))
                    list.add_full(CoordBBox::createCube(tile.getCoord(), MiddleT::DIM));
            for (auto middle = top->cbeginChildOn(); middle; ++middle)
                collect_boxes(*middle, list);
        }
        list.finish();
    }

    bool tile_exists(ValueT value, bool active) const
    {
        return convert_((double)value, active).exists;
    }

    /* Adds the boxes of a node with sides of 128 voxels: one for each octant, around its leaves and
     * leaf-sized tiles. */
    void collect_boxes(const MiddleT &node, BoxList &list) const
    {
        CoordBBox octants[8];
        auto octant_of = [&](const Coord &c) -> CoordBBox & {
            Coord at = (c - node.origin()) >> 6;
            return octants[at.x() | at.y() << 1 | at.z() << 2];
        };
        for (auto tile = node.cbeginValueAll(); tile; ++tile)
            if (tile_exists(*tile, tile.isValueOn())) {
                CoordBBox box = CoordBBox::createCube(tile.getCoord(), LeafT::DIM);
                list.include(box);
                octant_of(box.min()).expand(box);
            }
        for (auto leaf = node.cbeginChildOn(); leaf; ++leaf) {
            Coord origin = leaf.getCoord();
            CoordBBox box = mask_bounds(leaf->valueMask());
            if (!box.empty()) {
                box.translate(origin);
                list.include(box);
            }
            if (convert_.fills()) /* inactive voxels may be inside */
                box = CoordBBox::createCube(origin, LeafT::DIM);
            if (!box.empty())
                octant_of(origin).expand(box);
        }
        for (const CoordBBox &octant : octants)
            if (!octant.empty())
                list.add(octant);
    }

    void decode_leaves(const Part &whole) const
    {
        trip_vdb_stream is(fd_);
        io::StreamMetadata::Ptr metadata(new io::StreamMetadata(stream_));
        io::setStreamMetadataPtr(is, metadata);
        LeafT scratch;
        Coord first = whole.box.min() & ~(int32_t)(LeafT::DIM - 1);
        /* z is innermost, as in the order of leaves in the file */
        for (int32_t x = first.x(); x <= whole.box.max().x(); x += LeafT::DIM)
            for (int32_t y = first.y(); y <= whole.box.max().y(); y += LeafT::DIM)
                for (int32_t z = first.z(); z <= whole.box.max().z(); z += LeafT::DIM) {
                    Part part = whole;
                    part.box.intersect(CoordBBox::createCube(Coord(x, y, z), LeafT::DIM));
                    decode_leaf(part, is, scratch);
                }
    }

    void decode_leaf(const Part &part, trip_vdb_stream &is, LeafT &scratch) const
    {
        const LeafT *leaf = root_.probeConstLeaf(part.box.min());
        if (!leaf) {
            ValueT value;
            bool active = root_.probeValue(part.box.min(), value);
            Sample sample = convert_((double)value, active);
            if (sample.exists)
                part.fill([&](int32_t, int32_t, int32_t) { return sample; });
            return;
        }
        if constexpr (!in_memory) {
            if (!convert_.fills() && leaf->valueMask().isOff())
                return;
            is.seekg(leaf_offsets_[leaf->transientData()]);
            scratch.readBuffers(is, half_);
            leaf = &scratch;
        }
        part.fill([&](int32_t x, int32_t y, int32_t z) {
            openvdb::Index n = (openvdb::Index)((x & 7) << 6 | (y & 7) << 3 | (z & 7));
            return convert_((double)leaf->getValue(n), leaf->isValueOn(n));
        });
    }

    const trip_vdb_fd &fd_;
    bool half_;
    trip_vdb_reservation reserved_tree_, reserved_boxes_;
    /* The root suffices; a Tree would add unused code. */
    typename TreeT::RootNodeType root_;
    std::vector<int64_t> leaf_offsets_; /* by the leaf's transient data */
    io::StreamMetadata stream_;         /* for a stream that reads a leaf's values */
    Converter convert_;
};

template <typename TreeT> struct Load {
    static std::unique_ptr<trip_vdb_grid> run(const trip_vdb_fd &fd, trip_vdb_stream &is,
                                              bool as_half, const trip_vdb_conversion &conversion,
                                              trip_budget *budget, trip_scalar type)
    {
        std::unique_ptr<trip_vdb_grid> grid(
            new TypedGrid<TreeT>(fd, is, as_half, conversion, budget));
        grid->type = as_half ? TRIP_F16 : type;
        return grid;
    }
};

struct ScalarType {
    const char *name;
    trip_scalar type;
    decltype(&Load<openvdb::FloatTree>::run) load;
};

const ScalarType scalar_types[] = {
    { "float", TRIP_F32, Load<openvdb::FloatTree>::run },
    { "double", TRIP_F64, Load<openvdb::DoubleTree>::run },
    { "int32", TRIP_I32, Load<openvdb::Int32Tree>::run },
    { "int64", TRIP_I64, Load<openvdb::Int64Tree>::run },
    { "bool", TRIP_U8, Load<openvdb::BoolTree>::run },
    { "mask", TRIP_U8, Load<openvdb::MaskTree>::run },
};

const ScalarType *find_type(const trip_vdb_entry &entry)
{
    for (const ScalarType &t : scalar_types)
        if (entry.default_tree && entry.type == t.name)
            return &t;
    return nullptr;
}

} // namespace

trip_vdb_reservation::~trip_vdb_reservation()
{
    if (budget_)
        trip_budget_release(budget_, memory_, bytes_);
}

void trip_vdb_reservation::take(trip_budget *budget, uint64_t bytes, const char *stage)
{
    char needed[32], left[32];
    memory_ = trip_budget_take(budget, bytes);
    if (!memory_)
        throw trip_vdb_error(std::string(stage) + " needs " + trip_format_bytes(bytes, needed) +
                             ", but only " +
                             trip_format_bytes(trip_budget_left_bytes(budget), left) +
                             " of memory are left: raise --memory");
    budget_ = budget;
    bytes_ = bytes;
}

bool trip_vdb_is_scalar(const trip_vdb_entry &entry)
{
    return find_type(entry) != nullptr;
}

std::unique_ptr<trip_vdb_grid> trip_vdb_load(const trip_vdb_fd &fd, trip_vdb_stream &is,
                                             const trip_vdb_contents &contents,
                                             const trip_vdb_head &head, const trip_vdb_entry &entry,
                                             const trip_vdb_conversion &conversion,
                                             trip_budget *budget)
{
    io::StreamMetadata::Ptr metadata(new io::StreamMetadata);
    metadata->setFileVersion(contents.version);
    metadata->setLibraryVersion({ contents.library[0], contents.library[1] });
    metadata->setCompression(head.compression);
    metadata->setHalfFloat(entry.half);
    metadata->setSeekable(true);
    io::setStreamMetadataPtr(is, metadata);
    const ScalarType *type = find_type(entry);
    return type->load(fd, is, entry.half, conversion, budget, type->type);
}
