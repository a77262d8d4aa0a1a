#include "slice_files.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <memory>
#include <set>

#include <dirent.h>
#include <fcntl.h>
#include <glob.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

namespace
{

/* Orders names naturally: digits compare as numbers, other characters as bytes. */
bool natural_less(const std::string &a, const std::string &b)
{
    auto digits = [](const std::string &s, size_t &at) {
        while (at < s.size() && s[at] == '0')
            at++;
        size_t begin = at;
        while (at < s.size() && isdigit((unsigned char)s[at]))
            at++;
        return s.substr(begin, at - begin);
    };
    size_t i = 0, j = 0;
    while (i < a.size() && j < b.size()) {
        if (isdigit((unsigned char)a[i]) && isdigit((unsigned char)b[j])) {
            std::string x = digits(a, i), y = digits(b, j);
            if (x != y)
                return x.size() != y.size() ? x.size() < y.size() : x < y;
        } else if (a[i] != b[j]) {
            return (unsigned char)a[i] < (unsigned char)b[j];
        } else {
            i++;
            j++;
        }
    }
    bool a_ends = i == a.size(), b_ends = j == b.size();
    return a_ends != b_ends ? a_ends : a < b;
}

/* Opens without blocking, so that a FIFO is refused and not waited for. */
trip_image_kind kind_of_file(const std::string &name)
{
    unsigned char head[132];
    struct stat st;
    int fd = ::open(name.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0)
        throw trip_slice_error(name, std::string("cannot open: ") + std::strerror(errno));
    bool regular = ::fstat(fd, &st) == 0 && S_ISREG(st.st_mode);
    ssize_t n = regular ? ::pread(fd, head, sizeof head, 0) : 0;
    std::string why = n < 0 ? std::strerror(errno) : "";
    ::close(fd);
    if (!regular)
        throw trip_slice_error(name, "is not a regular file");
    if (n < 0)
        throw trip_slice_error(name, "cannot read: " + why);
    return trip_image_kind_of(head, (size_t)n);
}

/* Returns false for a broken link, too. */
bool is_regular(const std::string &name)
{
    struct stat st;
    return ::stat(name.c_str(), &st) == 0 && S_ISREG(st.st_mode);
}

/* Describes a file that is not a slice. */
std::string describe(const std::string &name)
{
    struct stat st;
    if (::stat(name.c_str(), &st) != 0)
        return ::lstat(name.c_str(), &st) == 0 && S_ISLNK(st.st_mode)
                   ? "is a broken link"
                   : std::string("cannot be examined: ") + std::strerror(errno);
    return S_ISDIR(st.st_mode) ? "is a folder"
           : S_ISREG(st.st_mode)
               ? "holds no TIFF, PNG, EXR or DICOM picture; the file may be damaged"
           : S_ISFIFO(st.st_mode) ? "is a pipe"
                                  : "is not a regular file";
}

/* Returns the names in a folder, without hidden files. */
std::vector<std::string> list_folder(const std::string &folder)
{
    std::unique_ptr<DIR, int (*)(DIR *)> dir(::opendir(folder.c_str()), ::closedir);
    if (!dir)
        throw trip_slice_error(folder, std::string("cannot open: ") + std::strerror(errno));
    std::vector<std::string> names;
    errno = 0;
    while (struct dirent *entry = ::readdir(dir.get()))
        if (entry->d_name[0] != '.')
            names.push_back(entry->d_name);
    if (errno)
        throw trip_slice_error(folder, std::string("cannot list: ") + std::strerror(errno));
    return names;
}

/* Splits "folder/name" into "folder/" and "name". */
void split_path(const std::string &path, std::string &folder, std::string &name)
{
    size_t slash = path.rfind('/');
    folder = slash == std::string::npos ? "" : path.substr(0, slash + 1);
    name = slash == std::string::npos ? path : path.substr(slash + 1);
}

/* A file name with one number in it. */
struct NumberPattern {
    std::string before, after;
    size_t width = 0; /* minimum number of digits, padded with zeros */
};

/* Returns true if `name` has exactly one of %d, %i or %u, optionally with a width ("%03d"). "%%" is
 * a percent sign. */
bool parse_pattern(const std::string &name, NumberPattern &pattern)
{
    int conversions = 0;
    for (size_t i = 0; i < name.size(); i++) {
        std::string &text = conversions ? pattern.after : pattern.before;
        if (name[i] != '%' || (i + 1 < name.size() && name[i + 1] == '%')) {
            i += name[i] == '%';
            text += name[i];
            continue;
        }
        size_t end = name.find_first_not_of("0123456789", i + 1);
        if (conversions++ || end == std::string::npos || !std::strchr("diu", name[end]) ||
            end - i > 3)
            return false;
        bool zeros = name[i + 1] == '0';
        pattern.width = zeros ? (size_t)std::atoi(name.c_str() + i + 1) : 0;
        i = end;
    }
    return conversions == 1;
}

/* Matches a name against the pattern and sets its number. The number must be written exactly as the
 * pattern writes it. */
bool match_number(const NumberPattern &p, const std::string &name, long long &number)
{
    if (name.size() <= p.before.size() + p.after.size() ||
        name.compare(0, p.before.size(), p.before) != 0 ||
        name.compare(name.size() - p.after.size(), p.after.size(), p.after) != 0)
        return false;
    std::string digits =
        name.substr(p.before.size(), name.size() - p.before.size() - p.after.size());
    if (digits.size() > 18 || digits.find_first_not_of("0123456789") != std::string::npos)
        return false;
    size_t min = std::max<size_t>(p.width, 1);
    if (digits.size() < min || (digits.size() > min && digits[0] == '0'))
        return false;
    number = std::atoll(digits.c_str());
    return true;
}

std::vector<std::string> find_numbered(const std::string &path, const std::string &folder,
                                       const NumberPattern &pattern)
{
    std::vector<std::pair<long long, std::string>> found;
    for (const std::string &name : list_folder(folder.empty() ? "." : folder)) {
        long long number;
        if (match_number(pattern, name, number))
            found.emplace_back(number, folder + name);
    }
    std::sort(found.begin(), found.end());
    std::vector<std::string> names;
    for (const auto &one : found)
        names.push_back(one.second);
    if (names.empty())
        throw trip_slice_error(path, "no file matches this pattern");
    return names;
}

std::vector<std::string> find_glob(const std::string &path)
{
    glob_t matches;
    int status = ::glob(path.c_str(), GLOB_NOSORT, nullptr, &matches);
    std::vector<std::string> names;
    if (status == 0)
        names.assign(matches.gl_pathv, matches.gl_pathv + matches.gl_pathc);
    ::globfree(&matches);
    if (status != 0)
        throw trip_slice_error(path, status == GLOB_NOMATCH ? "no file matches this pattern"
                                                            : "cannot be searched for");
    std::sort(names.begin(), names.end(), natural_less);
    return names;
}

bool is_named_as_slice(const std::string &name)
{
    static const char *const extensions[] = { ".tif", ".tiff", ".png", ".exr", ".dcm" };
    size_t dot = name.rfind('.');
    return dot != std::string::npos &&
           std::any_of(std::begin(extensions), std::end(extensions), [&](const char *extension) {
               return strcasecmp(name.c_str() + dot, extension) == 0;
           });
}

/* Finds the slices in a folder and ignores other files. A file with a slice's name that is not a
 * picture is an error, because its neighbours would then touch. A name is a slice's by its
 * extension, or by its shape if slices have that shape. */
std::vector<std::string> find_in_folder(const std::string &path)
{
    std::vector<std::string> names, others;
    std::set<std::string> shapes;
    for (const std::string &name : list_folder(path)) {
        std::string file = path + (path.back() == '/' ? "" : "/") + name;
        if (is_regular(file) && kind_of_file(file) != TRIP_IMAGE_OTHER) {
            names.push_back(file);
            shapes.insert(trip_name_shape(name));
        } else {
            others.push_back(file);
        }
    }
    std::sort(others.begin(), others.end(), natural_less);
    for (const std::string &file : others) {
        const std::string shape = trip_name_shape(file);
        if (is_named_as_slice(file) ||
            (shape.find('1') != std::string::npos && shapes.count(shape)))
            throw trip_slice_error(file, describe(file));
    }
    if (names.empty())
        throw trip_slice_error(path, "holds no TIFF, PNG, EXR or DICOM files");
    std::sort(names.begin(), names.end(), natural_less);
    return names;
}

std::vector<std::string> find_names(const std::string &path)
{
    struct stat st;
    if (::stat(path.c_str(), &st) == 0)
        return S_ISDIR(st.st_mode) ? find_in_folder(path) : std::vector<std::string>{ path };
    std::string folder, name;
    split_path(path, folder, name);
    NumberPattern pattern;
    if (name.find('%') == std::string::npos)
        return find_glob(path);
    if (!parse_pattern(name, pattern))
        throw trip_slice_error(
            path, "a pattern must have one number in the file name, such as %d or %03d",
            TRIP_USAGE);
    return find_numbered(path, folder, pattern);
}

} // namespace

bool trip_slice_is_dicom(const std::string &path)
{
    try {
        return is_regular(path) && kind_of_file(path) == TRIP_IMAGE_DICOM;
    } catch (const trip_slice_error &) {
        return false;
    }
}

trip_slice_files trip_slice_find(const std::string &path, bool allow_gaps)
{
    trip_slice_files files = { TRIP_IMAGE_OTHER, find_names(path) };
    for (const std::string &name : files.names) {
        trip_image_kind kind = is_regular(name) ? kind_of_file(name) : TRIP_IMAGE_OTHER;
        if (kind == TRIP_IMAGE_OTHER)
            throw trip_slice_error(name, is_regular(name) ? "is not a TIFF, PNG, EXR or DICOM file"
                                                          : describe(name) + ", not a slice");
        if (&name == &files.names.front())
            files.kind = kind;
        else if (kind != files.kind)
            throw trip_slice_error(path, std::string("has slices of different kinds, ") +
                                             trip_image_kind_name(files.kind) + " and " +
                                             trip_image_kind_name(kind) +
                                             "; select one kind with a pattern such as \"*.tif\"");
    }
    if (files.kind != TRIP_IMAGE_DICOM || path.find('%') != std::string::npos)
        trip_check_numbers(path, files.names, allow_gaps);
    return files;
}
