/* The outer layers of an OpenVDB file, read here because the library trusts them: it allocates what
 * a length field says and does not look whether a read came up short. Everything in this header
 * throws; nothing above read_vdb.cpp includes it. */
#ifndef TRIP_VDB_FILE_H
#define TRIP_VDB_FILE_H

#include <cstdint>
#include <istream>
#include <stdexcept>
#include <streambuf>
#include <string>
#include <vector>

#include "report.h"

/* What is wrong with the file, or with what is asked of it. */
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
    /* As pread(2), but throws on errors and on the end of the file. */
    size_t read_some(void *to, size_t bytes, int64_t offset) const;
    int64_t size() const
    {
        return size_;
    }

  private:
    int fd_;
    int64_t size_;
};

/* Buffered bytes of the file by position. A seek that stays in the buffer costs nothing, one beyond
 * the file's end fails. No mapping: pages read do not count as this process's memory, and a file
 * that shrinks meanwhile is an error, not a signal. */
class trip_vdb_buffer : public std::streambuf
{
  public:
    explicit trip_vdb_buffer(const trip_vdb_fd &fd) : fd_(fd)
    {
    }
    /* The last eight bytes that were read at once, and where they ended: where a compressed chunk
     * was passed over, its size and start. */
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

/* A stream for the library's readers and for ours. One thread at a time; several may share the
 * file. Any short read throws. */
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

/* A grid as the file's table of contents has it. */
struct trip_vdb_entry {
    std::string unique_name; /* with the library's separator and number where names repeat */
    std::string name;        /* for people: "density", or "density[1]" */
    std::string type;        /* "float", "vec3s", ... */
    std::string parent;      /* unique name of the grid whose tree this one shares, or empty */
    bool usual_tree;         /* of the 5-4-3 layout that all writers use */
    bool half;               /* floats are stored as 16 bits */
    int64_t offset;          /* of the grid in the file */
    int64_t end;             /* past its data, 0 when not known */
};

struct trip_vdb_contents {
    uint32_t version;     /* of the file format: 220 and later are read */
    uint32_t library[2];  /* version of the library that wrote it */
    uint32_t compression; /* of formats before 222; since then each grid has its own */
    bool has_offsets;     /* false: written as a stream, only the first grid can be found */
    std::vector<trip_vdb_entry> grids;
};

trip_vdb_contents trip_vdb_read_contents(const trip_vdb_fd &fd);

/* What precedes a grid's transform; the stream is left there. */
struct trip_vdb_head {
    uint32_t compression;
    std::string grid_class; /* "level set", "fog volume", ...; empty when the file does not say */
};
trip_vdb_head trip_vdb_read_head(trip_vdb_stream &is, const trip_vdb_contents &contents,
                                 const trip_vdb_entry &entry);

#endif
