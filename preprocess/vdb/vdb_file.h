/* Reads the outer layers of an OpenVDB file with checks that the library lacks: the library
 * allocates any length that the file gives, and ignores short reads. Everything in this header may
 * throw. Nothing above read_vdb.cpp includes it. */
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

/* An open file. It is immutable; any thread may read from it. */
class trip_vdb_fd
{
  public:
    explicit trip_vdb_fd(const char *path);
    trip_vdb_fd(const trip_vdb_fd &) = delete;
    trip_vdb_fd &operator=(const trip_vdb_fd &) = delete;
    ~trip_vdb_fd();
    /* Like pread(2), but throws on errors, at the end of the file, and on an interruption. Opening
     * and decoding mainly read, so they need no other check. */
    size_t read_some(void *to, size_t bytes, int64_t offset) const;
    int64_t size() const
    {
        return size_;
    }

  private:
    int fd_;
    int64_t size_;
};

/* A buffered view of the file. A seek within the buffer costs nothing; a seek beyond the file's end
 * throws. The file is not mapped, for two reasons. Mapped pages would count as this process's
 * memory, and a shrinking file would cause a signal instead of an error. */
class trip_vdb_buffer : public std::streambuf
{
  public:
    explicit trip_vdb_buffer(const trip_vdb_fd &fd) : fd_(fd)
    {
    }
    /* The value and end of the last read of exactly eight bytes. After the library skips a
     * compressed chunk, they are the chunk's size and start. */
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
    int64_t start_ = 0; /* position in the file of the buffer's first byte */
    char bytes_[16384];
};

/* A stream for the readers of the library and of this module. One thread at a time; streams of
 * several threads may read one file. Any short read throws. */
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
    /* Reads a string with a 32-bit length. Throws if the length exceeds `limit`. */
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
    std::string unique_name; /* with the library's separator and number if a name repeats */
    std::string name;        /* as shown to users: "density", or "density[1]" */
    std::string type;        /* "float", "vec3s", ... */
    std::string parent; /* unique name of the grid with the tree that this grid shares, or empty */
    bool default_tree;  /* tree of the 5-4-3 layout, which all writers use */
    bool half;          /* floats are stored as 16 bits */
    int64_t offset;     /* of the grid in the file */
    int64_t end;        /* of the grid's data in the file; 0 if unknown */
};

struct trip_vdb_contents {
    uint32_t version;     /* of the file format; at least 220 */
    uint32_t library[2];  /* version of the library that wrote the file */
    uint32_t compression; /* for formats before 222; later, each grid has its own */
    bool has_offsets; /* false for a file written as a stream, in which only the first grid can be
                         found */
    std::string creator; /* program that wrote the file; empty if unknown */
    std::vector<trip_vdb_entry> grids;
};

trip_vdb_contents trip_vdb_read_contents(const trip_vdb_fd &fd);

/* The part of a grid before its transform. */
struct trip_vdb_head {
    uint32_t compression;
    std::string grid_class; /* "level set", "fog volume", ...; empty if unknown */
    std::string creator;    /* program that made the grid; empty if unknown */
};
/* Reads the head of a grid and leaves the stream at the transform. */
trip_vdb_head trip_vdb_read_head(trip_vdb_stream &is, const trip_vdb_contents &contents,
                                 const trip_vdb_entry &entry);

#endif
