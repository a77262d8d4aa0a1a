/* Reads the outer layers of an OpenVDB file with checks that the library does not make: it
 * allocates what a length field says and ignores short reads. Everything in this header may throw;
 * nothing above read_vdb.cpp includes it. */
#ifndef TRIP_VDB_FILE_H
#define TRIP_VDB_FILE_H

#include <cstdint>
#include <istream>
#include <stdexcept>
#include <streambuf>
#include <string>
#include <vector>

#include "report.h"

/* A fault of the file, or an option that does not apply to it. */
struct trip_vdb_error : std::runtime_error {
    explicit trip_vdb_error(const std::string &why, int code = TRIP_ERROR)
        : std::runtime_error(why), status(code)
    {
    }
    int status;
};

/* An open file. Immutable once open; any thread may read from it. */
class trip_vdb_fd
{
  public:
    explicit trip_vdb_fd(const char *path);
    trip_vdb_fd(const trip_vdb_fd &) = delete;
    trip_vdb_fd &operator=(const trip_vdb_fd &) = delete;
    ~trip_vdb_fd();
    /* As pread(2), but throws on errors, on the end of the file, and where the work of the thread
     * is interrupted: reading is what opening and decoding take their time for. */
    size_t read_some(void *to, size_t bytes, int64_t offset) const;
    int64_t size() const
    {
        return size_;
    }

  private:
    int fd_;
    int64_t size_;
};

/* A buffered view of the file. A seek within the buffer costs nothing; one beyond the file's end
 * throws. The file is not mapped, so that its pages do not count as this process's memory, and a
 * file that shrinks meanwhile is an error, not a signal. */
class trip_vdb_buffer : public std::streambuf
{
  public:
    explicit trip_vdb_buffer(const trip_vdb_fd &fd) : fd_(fd)
    {
    }
    /* The value and end of the last read of exactly eight bytes: after a compressed chunk was
     * skipped, these are the chunk's size and start. */
    int64_t last_word = 0, last_word_end = -1;

  protected:
    int_type underflow() override;
    std::streamsize xsgetn(char *to, std::streamsize bytes) override;
    pos_type seekoff(off_type offset, std::ios_base::seekdir from,
                     std::ios_base::openmode) override;
    pos_type seekpos(pos_type position, std::ios_base::openmode mode) override;

  private:
    int64_t position() const
    {
        return start_ + (gptr() - eback());
    }
    const trip_vdb_fd &fd_;
    int64_t start_ = 0; /* in the file, of the buffer's first byte */
    char bytes_[16384];
};

/* A stream for the library's readers and for those here. One thread at a time; streams of several
 * threads may read one file. Any short read throws. */
class trip_vdb_stream : private trip_vdb_buffer, public std::istream
{
  public:
    explicit trip_vdb_stream(const trip_vdb_fd &fd);
    template <typename T> T get_value()
    {
        T value;
        read(reinterpret_cast<char *>(&value), sizeof value);
        return value;
    }
    /* A string with a 32-bit length, which may be `limit` at most. */
    std::string get_string(uint32_t limit);
    void skip(int64_t bytes)
    {
        seekg(bytes, std::ios_base::cur);
    }
    int64_t chunk_bytes() const
    {
        return last_word;
    }
    int64_t chunk_start() const
    {
        return last_word_end;
    }
};

/* A grid's entry in the file's table of contents. */
struct trip_vdb_entry {
    std::string unique_name; /* with the library's separator and number where a name repeats */
    std::string name;        /* as shown to users: "density", or "density[1]" */
    std::string type;        /* "float", "vec3s", ... */
    std::string parent;      /* unique name of the grid whose tree this one uses, or empty */
    bool default_tree;       /* of the 5-4-3 layout that all writers use */
    bool half;               /* floats are stored as 16 bits */
    int64_t offset;          /* of the grid in the file */
    int64_t end;             /* of its data in the file; 0: unknown */
};

struct trip_vdb_contents {
    uint32_t version;     /* of the file format: 220 and later are read */
    uint32_t library[2];  /* version of the library that wrote it */
    uint32_t compression; /* of formats before 222; since then each grid has its own */
    bool has_offsets;     /* false: written as a stream, only the first grid can be found */
    std::vector<trip_vdb_entry> grids;
};

trip_vdb_contents trip_vdb_read_contents(const trip_vdb_fd &fd);

/* What precedes a grid's transform. */
struct trip_vdb_head {
    uint32_t compression;
    std::string grid_class; /* "level set", "fog volume", ...; empty: unknown */
};
/* Reads it, and leaves the stream at the transform. */
trip_vdb_head trip_vdb_read_head(trip_vdb_stream &is, const trip_vdb_contents &contents,
                                 const trip_vdb_entry &entry);

#endif
