/* Reads a variable of a netCDF-4 file with libnetcdf. It must have at least three dimensions; the
 * last three are k, j and i. The first of the other dimensions is time, the second has channels,
 * and all others are read at their first index. Throws trip_netcdf_error. One thread. */
#ifndef TRIP_NETCDF_FILE_H
#define TRIP_NETCDF_FILE_H

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "image_helper.h"

class trip_netcdf_error : public std::runtime_error
{
  public:
    using std::runtime_error::runtime_error;
};

/* The index in the first and in the second dimension before the last three. */
struct trip_netcdf_entry {
    int64_t time, channel;
};

class trip_netcdf_file
{
  public:
    /* Opens the variable `name` ("GROUP/NAME" in a group). An empty name selects the variable with
     * the most values. Caches use part of `memory_bytes`. */
    trip_netcdf_file(const std::string &path, const std::string &name,
                     const trip_netcdf_entry &entry, uint64_t memory_bytes);
    ~trip_netcdf_file();
    trip_netcdf_file(const trip_netcdf_file &) = delete;
    trip_netcdf_file &operator=(const trip_netcdf_file &) = delete;

    /* Describes the variable. `coordinates` holds the values of the axes in `about.placed`. */
    trip_image_netcdf about = {};
    std::vector<double> coordinates;

    size_t slice_bytes() const;
    /* Reads slice k in the type and size of `about`. */
    void read(int64_t k, void *values);

  private:
    struct variable;
    void open_variable(const std::string &name, const trip_netcdf_entry &entry,
                       uint64_t memory_bytes);
    void find(int group, const std::string &prefix, const std::string &name, variable &found);
    void set_type(int type);
    void position(int axis, int dimension);
    void keep_chunks(uint64_t memory_bytes);

    int file_ = -1;
    std::vector<size_t> first_; /* index in each dimension */
    int group_ = -1, variable_ = -1, count_ = 0;
    int stored_ = 0; /* trip_scalar */
    bool decoded_ = false;
    double missing_[2];
    std::vector<char> raw_;
};

#endif
