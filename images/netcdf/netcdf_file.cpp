#include "netcdf_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <netcdf.h>
#include <strings.h>

#include "volume_info.h"

namespace
{

/* trip_scalar by netCDF type; -1 for types that hold no volumes. */
const int scalar_of[] = { -1,       TRIP_I8, -1,       TRIP_I16, TRIP_I32, TRIP_F32,
                          TRIP_F64, TRIP_U8, TRIP_U16, TRIP_U32, TRIP_I64, TRIP_U64 };
constexpr int types = sizeof scalar_of / sizeof *scalar_of;

void check(int status)
{
    if (status != NC_NOERR)
        throw trip_netcdf_error(std::string("libnetcdf reports: ") + nc_strerror(status));
}

bool is_number(int type)
{
    return type >= 0 && type < types && scalar_of[type] >= 0;
}

/* Sets `value` to the first number of an attribute. Leaves it unchanged if there is none. */
void take_attribute(int group, int variable, const char *name, double &value)
{
    nc_type type;
    size_t count;
    if (nc_inq_att(group, variable, name, &type, &count) != NC_NOERR || !is_number(type) ||
        count == 0 || count > 1 << 16)
        return;
    std::vector<double> all(count);
    check(nc_get_att_double(group, variable, name, all.data()));
    value = all[0];
}

/* Whether the attribute _Unsigned is the text "true", as characters or as one string. */
bool is_unsigned(int group, int variable)
{
    nc_type type;
    size_t count;
    std::string text;
    if (nc_inq_att(group, variable, "_Unsigned", &type, &count) != NC_NOERR || count > 8)
        return false;
    if (type == NC_CHAR) {
        text.resize(count);
        check(nc_get_att_text(group, variable, "_Unsigned", &text[0]));
    } else if (type == NC_STRING && count == 1) {
        char *held = nullptr;
        check(nc_get_att_string(group, variable, "_Unsigned", &held));
        text = held ? held : "";
        nc_free_string(1, &held);
    }
    return strcasecmp(text.c_str(), "true") == 0;
}

std::vector<int> dimensions_of(int group, int variable)
{
    int count;
    check(nc_inq_varndims(group, variable, &count));
    std::vector<int> dimensions((size_t)count);
    check(nc_inq_vardimid(group, variable, dimensions.data()));
    return dimensions;
}

size_t length_of(int group, int dimension)
{
    size_t length;
    check(nc_inq_dimlen(group, dimension, &length));
    return length;
}

/* Returns the number of values in the last three dimensions, or 0 if the variable is not a volume.
 */
double volume_of(int group, int variable)
{
    nc_type type;
    check(nc_inq_vartype(group, variable, &type));
    const std::vector<int> dimensions = dimensions_of(group, variable);
    if (dimensions.size() < 3 || !is_number(type))
        return 0;
    double values = 1;
    for (size_t i = dimensions.size() - 3; i < dimensions.size(); i++)
        values *= (double)length_of(group, dimensions[i]);
    return values;
}

std::string name_of(int group, int variable)
{
    char name[NC_MAX_NAME + 1] = "";
    check(nc_inq_varname(group, variable, name));
    return name;
}

} // namespace

struct trip_netcdf_file::variable {
    int group = -1, number = -1;
    std::string name;
    double values = -1;
    int volumes = 0;
};

trip_netcdf_file::trip_netcdf_file(const std::string &path, const std::string &name,
                                   const trip_netcdf_entry &entry, uint64_t memory_bytes)
{
    check(nc_open(path.c_str(), NC_NOWRITE, &file_));
    try {
        open_variable(name, entry, memory_bytes);
    } catch (...) {
        nc_close(file_);
        throw;
    }
}

trip_netcdf_file::~trip_netcdf_file()
{
    nc_close(file_);
}

/* Finds the variable `name`, or the largest one if `name` is empty, in a group and its subgroups.
 */
void trip_netcdf_file::find(int group, const std::string &prefix, const std::string &name,
                            variable &found)
{
    int count = 0;
    check(nc_inq_varids(group, &count, nullptr));
    std::vector<int> numbers((size_t)count);
    check(nc_inq_varids(group, &count, numbers.data()));
    for (int number : numbers) {
        const std::string full = prefix + name_of(group, number);
        const double values = volume_of(group, number);
        found.volumes += values > 0;
        if (name.empty() ? values > std::max(0.0, found.values) : full == name) {
            found.group = group;
            found.number = number;
            found.name = full;
            found.values = values;
        }
    }
    check(nc_inq_grps(group, &count, nullptr));
    std::vector<int> groups((size_t)count);
    check(nc_inq_grps(group, &count, groups.data()));
    for (int inner : groups) {
        char of_group[NC_MAX_NAME + 1] = "";
        check(nc_inq_grpname(inner, of_group));
        find(inner, prefix + of_group + "/", name, found);
    }
}

void trip_netcdf_file::set_type(int type)
{
    stored_ = scalar_of[type];
    about.slope = 1;
    missing_[0] = missing_[1] = std::numeric_limits<double>::quiet_NaN();
    take_attribute(group_, variable_, "scale_factor", about.slope);
    take_attribute(group_, variable_, "add_offset", about.inter);
    take_attribute(group_, variable_, "_FillValue", missing_[0]);
    take_attribute(group_, variable_, "missing_value", missing_[1]);
    if ((type == NC_FLOAT || type == NC_DOUBLE) && std::isnan(missing_[0]))
        missing_[0] = NC_FILL_DOUBLE;
    if (is_unsigned(group_, variable_) && stored_ < TRIP_F16) {
        stored_ = trip_scalar_unsigned((trip_scalar)stored_);
        for (double &missing : missing_)
            missing = trip_scalar_without_sign((trip_scalar)stored_, missing);
    }
    decoded_ = !std::isnan(missing_[0]) || !std::isnan(missing_[1]);
    about.type = decoded_ ? TRIP_F32 : stored_;
}

/* Reads the coordinates of a dimension from the variable with its name, in the same group or an
 * enclosing one. */
void trip_netcdf_file::position(int axis, int dimension)
{
    char name[NC_MAX_NAME + 1] = "";
    check(nc_inq_dimname(group_, dimension, name));
    for (int group = group_;;) {
        int number;
        nc_type type;
        if (nc_inq_varid(group, name, &number) == NC_NOERR) {
            check(nc_inq_vartype(group, number, &type));
            if (is_number(type) && dimensions_of(group, number) == std::vector<int>{ dimension }) {
                const size_t before = coordinates.size(), count = (size_t)about.dims[axis];
                double slope = 1, inter = 0;
                coordinates.resize(before + count);
                check(nc_get_var_double(group, number, coordinates.data() + before));
                take_attribute(group, number, "scale_factor", slope);
                take_attribute(group, number, "add_offset", inter);
                const trip_scalar held = (trip_scalar)scalar_of[type];
                const bool without = held < TRIP_F16 && is_unsigned(group, number);
                for (size_t i = before; i < coordinates.size(); i++) {
                    double &at = coordinates[i];
                    at = slope * (without ? trip_scalar_without_sign(held, at) : at) + inter;
                }
                about.placed |= 1 << axis;
                return;
            }
        }
        if (nc_inq_grp_parent(group, &group) != NC_NOERR)
            return;
    }
}

/* Sets the chunk cache to all chunks of a slice, so that each chunk is decoded only once. If they
 * need more than half of the memory, caches one chunk. */
void trip_netcdf_file::keep_chunks(uint64_t memory_bytes)
{
    int storage;
    std::vector<size_t> chunk((size_t)count_);
    check(nc_inq_var_chunking(group_, variable_, &storage, chunk.data()));
    about.helper_bytes = slice_bytes();
    if (storage != NC_CHUNKED)
        return;
    double one = (double)trip_scalar_bytes((trip_scalar)stored_), across = 1;
    for (size_t length : chunk)
        one *= (double)length;
    for (int a = 0; a < 2; a++)
        across *= std::ceil((double)about.dims[a] / (double)chunk[(size_t)(count_ - 1 - a)]);
    const double all = one * across <= 0.5 * (double)memory_bytes ? one * across : one;
    if (!(all <= 0.5 * (double)memory_bytes))
        throw trip_netcdf_error("its chunks do not fit the memory allowed; raise --memory");
    /* HDF5 recommends a hash table with a hundred times as many slots as chunks. */
    const size_t positions = 100 * (size_t)std::min(across, 1e5) + 1;
    check(nc_set_var_chunk_cache(group_, variable_, (size_t)all, positions, 1.0F));
    about.helper_bytes += (uint64_t)(all + one) + positions * sizeof(void *);
}

void trip_netcdf_file::open_variable(const std::string &name, const trip_netcdf_entry &entry,
                                     uint64_t memory_bytes)
{
    variable found;
    int minc;
    if (nc_inq_grp_ncid(file_, "minc-2.0", &minc) == NC_NOERR)
        throw trip_netcdf_error(TRIP_VOLUME_MINC);
    int nodes, blocks;
    if (nc_inq_dimid(file_, TRIP_VOLUME_EXODUS_NODES, &nodes) == NC_NOERR &&
        nc_inq_dimid(file_, TRIP_VOLUME_EXODUS_BLOCKS, &blocks) == NC_NOERR)
        throw trip_netcdf_error(TRIP_VOLUME_EXODUS);
    find(file_, "", name, found);
    if (found.number < 0)
        throw trip_netcdf_error(name.empty() ? "is HDF5 or netCDF-4 without an array of numbers on "
                                               "three axes; `h5dump -n` lists its contents"
                                             : "has no variable \"" + name + "\"");
    if (!(found.values > 0))
        throw trip_netcdf_error("its variable \"" + found.name +
                                "\" does not have three dimensions of numbers");
    group_ = found.group;
    variable_ = found.number;
    const std::vector<int> dimensions = dimensions_of(group_, variable_);
    count_ = (int)dimensions.size();
    nc_type type;
    check(nc_inq_vartype(group_, variable_, &type));
    set_type(type);
    for (int a = 0; a < 3; a++) {
        const size_t length = length_of(group_, dimensions[(size_t)(count_ - 1 - a)]);
        about.dims[a] = (int64_t)std::min(length, (size_t)INT64_MAX);
    }
    if ((double)about.dims[0] * (double)about.dims[1] * 8 > (double)memory_bytes)
        throw trip_netcdf_error("its slices do not fit the memory allowed; raise --memory");
    for (int a = 0; a < 3; a++)
        position(a, dimensions[(size_t)(count_ - 1 - a)]);
    std::strncpy(about.name, found.name.c_str(), sizeof about.name - 1);
    about.others = found.volumes > 1;
    about.deeper = count_ > 5;
    first_.assign((size_t)count_, 0);
    about.times = about.channels = 1;
    if (count_ > 3) {
        about.times = (int64_t)length_of(group_, dimensions[0]);
        first_[0] = (size_t)entry.time;
    }
    if (count_ > 4) {
        about.channels = (int64_t)length_of(group_, dimensions[1]);
        first_[1] = (size_t)entry.channel;
    }
    keep_chunks(memory_bytes);
}

size_t trip_netcdf_file::slice_bytes() const
{
    return (size_t)about.dims[0] * (size_t)about.dims[1] *
           trip_scalar_bytes((trip_scalar)about.type);
}

void trip_netcdf_file::read(int64_t k, void *values)
{
    std::vector<size_t> start = first_, count((size_t)count_, 1);
    const size_t in_slice = (size_t)about.dims[0] * (size_t)about.dims[1];
    start[(size_t)count_ - 3] = (size_t)k;
    count[(size_t)count_ - 2] = (size_t)about.dims[1];
    count[(size_t)count_ - 1] = (size_t)about.dims[0];
    if (decoded_)
        raw_.resize(in_slice * trip_scalar_bytes((trip_scalar)stored_));
    check(nc_get_vara(group_, variable_, start.data(), count.data(),
                      decoded_ ? raw_.data() : values));
    if (!decoded_)
        return;
    float *to = static_cast<float *>(values);
    trip_scalar_decode((trip_scalar)stored_, false, 1, 0, raw_.data(), in_slice, to);
    for (size_t i = 0; i < in_slice; i++)
        if (to[i] == (float)missing_[0] || to[i] == (float)missing_[1])
            to[i] = std::numeric_limits<float>::quiet_NaN();
}
