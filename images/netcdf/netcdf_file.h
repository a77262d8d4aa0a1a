/* A variable of a file of netCDF-4, by libnetcdf: one of three dimensions or more, the last of
 * which are k, j and i; of those before, the first place. Throws trip_netcdf_error. One thread. */
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

class trip_netcdf_file
{
  public:
    /* The variable of that name ("GROUP/NAME" in a group), or, where `name` is empty, that with the
     * most values. What is kept of it while it is read takes a part of `memory_bytes`. */
    trip_netcdf_file(const std::string &path, const std::string &name, uint64_t memory_bytes);
    ~trip_netcdf_file();
    trip_netcdf_file(const trip_netcdf_file &) = delete;
    trip_netcdf_file &operator=(const trip_netcdf_file &) = delete;

    /* What is said of it; `coordinates` are those of the axes that it names. */
    trip_image_netcdf about = {};
    std::vector<double> coordinates;

    size_t slice_bytes() const;
    /* Slice k as `about` says. */
    void read(int64_t k, void *values);

  private:
    struct variable;
    void open_variable(const std::string &name, uint64_t memory_bytes);
    void find(int group, const std::string &prefix, const std::string &name, variable &found);
    void set_type(int type);
    void position(int axis, int dimension);
    void keep_chunks(uint64_t memory_bytes);

    int file_ = -1;
    int group_ = -1, variable_ = -1, count_ = 0;
    int stored_ = 0; /* trip_scalar */
    bool decoded_ = false;
    double missing_[2];
    std::vector<char> raw_;
};

#endif
