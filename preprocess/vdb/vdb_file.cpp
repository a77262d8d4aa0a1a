#include "vdb_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <openvdb/io/Compression.h>
#include <openvdb/io/GridDescriptor.h>

namespace
{

constexpr int64_t magic = 0x56444220; /* " BDV" as bytes */
constexpr uint32_t oldest_version = openvdb::OPENVDB_FILE_VERSION_SELECTIVE_COMPRESSION;
constexpr uint32_t name_limit = 65536; /* bytes */
constexpr const char *half_suffix = "_HalfFloat";

/* Reads name, type and value of each item. Calls item(name, type, value bytes) with the stream at
 * the value. */
template <typename Item> void read_metadata(trip_vdb_stream &is, const Item &item)
{
    uint32_t count = is.get_value<uint32_t>();
    for (uint32_t i = 0; i < count; i++) {
        std::string name = is.get_string(name_limit);
        std::string type = is.get_string(name_limit);
        uint32_t bytes = is.get_value<uint32_t>();
        int64_t end = (int64_t)is.tellg() + bytes;
        item(name, type, bytes);
        is.seekg(end);
    }
}

/* Reads the value of an item of metadata if it is a short string. Otherwise returns "" and reads
 * nothing. */
std::string read_text(trip_vdb_stream &is, const std::string &type, uint32_t bytes)
{
    std::string text;
    if (type != "string" || bytes > name_limit)
        return text;
    text.resize(bytes);
    if (bytes > 0)
        is.read(&text[0], bytes);
    return text;
}

/* Parses "Tree_float_5_4_3" or "Tree_float_5_4_3_HalfFloat". */
void split_type(std::string type, trip_vdb_entry &entry)
{
    size_t suffix = type.rfind(half_suffix);
    entry.half = suffix != std::string::npos && suffix + std::strlen(half_suffix) == type.size();
    if (entry.half)
        type.resize(suffix);
    const std::string prefix = "Tree_", layout = "_5_4_3";
    entry.default_tree = type.size() > prefix.size() + layout.size() &&
                         type.compare(0, prefix.size(), prefix) == 0 &&
                         type.compare(type.size() - layout.size(), layout.size(), layout) == 0;
    entry.type = type;
    if (entry.default_tree)
        entry.type = type.substr(prefix.size(), type.size() - prefix.size() - layout.size());
}

trip_vdb_entry read_entry(trip_vdb_stream &is)
{
    trip_vdb_entry entry;
    entry.unique_name = is.get_string(name_limit);
    entry.name = openvdb::io::GridDescriptor::nameAsString(entry.unique_name);
    split_type(is.get_string(name_limit), entry);
    entry.parent = is.get_string(name_limit);
    entry.offset = is.get_value<int64_t>();
    is.get_value<int64_t>(); /* position of the leaves, unused */
    entry.end = is.get_value<int64_t>();
    return entry;
}

void read_entries(trip_vdb_stream &is, int64_t size, trip_vdb_contents &contents)
{
    int32_t count = is.get_value<int32_t>();
    if (count < 1)
        throw trip_vdb_error("contains no grid");
    for (int32_t i = 0; i < count; i++) {
        trip_vdb_entry entry = read_entry(is);
        if (!contents.has_offsets) {
            entry.offset = is.tellg();
            entry.end = 0;
            contents.grids.push_back(entry);
            return;
        }
        if (entry.end > size)
            throw trip_vdb_error("is truncated: grid \"" + entry.name + "\" ends at byte " +
                                 std::to_string(entry.end) + ", the file at " +
                                 std::to_string(size));
        if (entry.offset < is.tellg() || entry.end < entry.offset)
            throw trip_vdb_error("is corrupt: grid \"" + entry.name +
                                 "\" has an impossible position");
        contents.grids.push_back(entry);
        is.seekg(entry.end);
    }
}

} // namespace

trip_vdb_fd::trip_vdb_fd(const char *path) : fd_(::open(path, O_RDONLY | O_CLOEXEC))
{
    struct stat st;
    if (fd_ < 0 || ::fstat(fd_, &st) != 0) {
        std::string why = std::string("cannot open: ") + std::strerror(errno);
        if (fd_ >= 0)
            ::close(fd_);
        throw trip_vdb_error(why);
    }
    size_ = st.st_size;
}

trip_vdb_fd::~trip_vdb_fd()
{
    ::close(fd_);
}

size_t trip_vdb_fd::read_some(void *to, size_t bytes, int64_t offset) const
{
    for (;;) {
        if (trip_interrupted())
            throw trip_vdb_error("interrupted", TRIP_INTERRUPTED);
        ssize_t n = ::pread(fd_, to, bytes, offset);
        if (n > 0)
            return (size_t)n;
        if (n == 0)
            throw trip_vdb_error("ends early, at byte " + std::to_string(offset) +
                                 ": truncated or corrupt");
        if (errno != EINTR)
            throw trip_vdb_error("cannot read at byte " + std::to_string(offset) + ": " +
                                 std::strerror(errno));
    }
}

trip_vdb_buffer::int_type trip_vdb_buffer::underflow()
{
    start_ = position();
    setg(bytes_, bytes_, bytes_);
    size_t n = fd_.read_some(bytes_, sizeof bytes_, start_);
    setg(bytes_, bytes_, bytes_ + n);
    return traits_type::to_int_type(*gptr());
}

std::streamsize trip_vdb_buffer::xsgetn(char *to, std::streamsize bytes)
{
    std::streamsize n = std::streambuf::xsgetn(to, bytes);
    if (n == sizeof last_word) {
        std::memcpy(&last_word, to, sizeof last_word);
        last_word_end = position();
    }
    return n;
}

trip_vdb_buffer::pos_type trip_vdb_buffer::seekoff(off_type offset, std::ios_base::seekdir from,
                                                   std::ios_base::openmode)
{
    int64_t base = from == std::ios_base::beg   ? 0
                   : from == std::ios_base::cur ? position()
                                                : fd_.size();
    int64_t to;
    if (__builtin_add_overflow(base, (int64_t)offset, &to) || to < 0 || to > fd_.size())
        throw trip_vdb_error("is corrupt or truncated: data at byte " + std::to_string(base) +
                             " do not fit in the file");
    if (to >= start_ && to <= start_ + (egptr() - eback())) {
        setg(eback(), eback() + (to - start_), egptr());
    } else {
        start_ = to;
        setg(bytes_, bytes_, bytes_);
    }
    return pos_type(to);
}

trip_vdb_buffer::pos_type trip_vdb_buffer::seekpos(pos_type position, std::ios_base::openmode mode)
{
    return seekoff(off_type(position), std::ios_base::beg, mode);
}

trip_vdb_stream::trip_vdb_stream(const trip_vdb_fd &fd)
    : trip_vdb_buffer(fd), std::istream(static_cast<trip_vdb_buffer *>(this))
{
    exceptions(std::ios_base::failbit | std::ios_base::badbit | std::ios_base::eofbit);
}

std::string trip_vdb_stream::get_string(uint32_t limit)
{
    uint32_t bytes = get_value<uint32_t>();
    if (bytes > limit)
        throw trip_vdb_error("is corrupt: a name of " + std::to_string(bytes) +
                             " bytes before byte " + std::to_string((int64_t)tellg()));
    std::string text(bytes, ' ');
    if (bytes > 0)
        read(&text[0], bytes);
    return text;
}

trip_vdb_contents trip_vdb_read_contents(const trip_vdb_fd &fd)
{
    trip_vdb_stream is(fd);
    trip_vdb_contents contents = {};
    if (is.get_value<int64_t>() != magic)
        throw trip_vdb_error("is not an OpenVDB file");
    contents.version = is.get_value<uint32_t>();
    if (contents.version < oldest_version || contents.version > openvdb::OPENVDB_FILE_VERSION)
        throw trip_vdb_error("has file format version " + std::to_string(contents.version) +
                             "; versions " + std::to_string(oldest_version) + " to " +
                             std::to_string(openvdb::OPENVDB_FILE_VERSION) + " are known");
    contents.library[0] = is.get_value<uint32_t>();
    contents.library[1] = is.get_value<uint32_t>();
    contents.has_offsets = is.get_value<char>() != 0;
    if (contents.version < openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION)
        contents.compression =
            is.get_value<char>() ? openvdb::io::COMPRESS_ZIP : openvdb::io::COMPRESS_NONE;
    is.skip(36); /* the file's UUID as text */
    read_metadata(is, [&](const std::string &name, const std::string &type, uint32_t bytes) {
        if (name == "creator")
            contents.creator = read_text(is, type, bytes);
    });
    read_entries(is, fd.size(), contents);
    return contents;
}

trip_vdb_head trip_vdb_read_head(trip_vdb_stream &is, const trip_vdb_contents &contents,
                                 const trip_vdb_entry &entry)
{
    trip_vdb_head head = { contents.compression, "", "" };
    is.seekg(entry.offset);
    if (contents.version >= openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION)
        head.compression = is.get_value<uint32_t>();
    const uint32_t known =
        openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK | openvdb::io::COMPRESS_BLOSC;
    if (head.compression & ~known)
        throw trip_vdb_error("is corrupt, or compressed in an unknown way: flags " +
                             std::to_string(head.compression));
    read_metadata(is, [&](const std::string &name, const std::string &type, uint32_t bytes) {
        if (name == "class")
            head.grid_class = read_text(is, type, bytes);
        else if (name == "creator")
            head.creator = read_text(is, type, bytes);
    });
    return head;
}
