#include "other_file.h"

#include <inttypes.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "text.h"

typedef struct file {
    const char *path;
    size_t stem; /* length of the path without .gz or .bz2 */
    const unsigned char *head;
    size_t bytes;
    char *text; /* the sentence */
} file;

#define SAY(...) ((void)snprintf(f->text, TRIP_OTHER_TEXT_BYTES, __VA_ARGS__))

static bool ends_in(const file *f, const char *suffix)
{
    const size_t n = strlen(suffix);
    return f->stem > n && strncasecmp(f->path + f->stem - n, suffix, n) == 0;
}

static bool has_at(const file *f, size_t at, const char *bytes, size_t count)
{
    return f->bytes >= at + count && memcmp(f->head + at, bytes, count) == 0;
}

static bool begins(const file *f, const char *text)
{
    return has_at(f, 0, text, strlen(text));
}

/* Returns whether the first bytes contain a text. */
static bool holds(const file *f, const char *text)
{
    return memmem(f->head, f->bytes, text, strlen(text)) != NULL;
}

static uint32_t number_at(const file *f, size_t at)
{
    const unsigned char *p = f->head + at;
    return p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

/* Returns whether the first bytes are text: UTF-8 without control characters. */
static bool is_text(const file *f)
{
    char head[TRIP_OTHER_HEAD_BYTES + 1];
    const size_t bytes = f->bytes < TRIP_OTHER_HEAD_BYTES ? f->bytes : TRIP_OTHER_HEAD_BYTES;
    memcpy(head, f->head, bytes);
    head[bytes] = 0;
    for (const char *p = head; p < head + bytes;) {
        const trip_text_character c = trip_text_next(p);
        const bool cut = c.code == 0xfffd && p + 4 > head + bytes; /* a character may be cut */
        if (!c.printable && !cut && !strchr("\n\r\t\f", *p))
            return false;
        if (!*p)
            return false;
        p += c.bytes;
    }
    return bytes > 0;
}

/* ---- formats with a mark at a fixed place ---- */

/* The end of the line for scenes that trip_gaussian_file_open() reads. */
#define DESCRIBED "; `triptych info FILE` describes it"

typedef struct mark {
    size_t at;
    const char *bytes;
    size_t count;
    const char *text; /* the kind, then the program that reads it */
} mark;

#define MARK(at, bytes, text)                                                                      \
    {                                                                                              \
        at, bytes, sizeof(bytes) - 1, text                                                         \
    }

static const mark marks[] = {
    MARK(0, "MATLAB 7.3 MAT",
         "is a MATLAB file (v7.3, in HDF5); `h5dump -n` lists its arrays, and "
         "MATLAB or Python's h5py reads them"),
    MARK(0, "MATLAB 5.0 MAT",
         "is a MATLAB file (v5); MATLAB, GNU Octave or Python's scipy.io reads "
         "its arrays, which NRRD, NIfTI or raw data can hold"),
    MARK(0, "\x89HDF\r\n\x1a\n",
         "is HDF5 without a volume that netCDF-4 describes; `h5dump -n` "
         "lists its contents"),
    MARK(0, "\x0e\x03\x13\x01", "is HDF4; `hdp list` lists its contents"),
    MARK(0, "GRIB", "is GRIB, weather data; `cdo -f nc copy IN.grb OUT.nc` converts it to netCDF"),
    MARK(0,
         "SIMPLE  =", "is FITS, pictures of astronomy; SAOImage DS9 or Python's astropy reads it"),
    MARK(0, "# AmiraMesh", "is an Amira file; Amira or Avizo opens it"),
    MARK(0, "# Avizo", "is an Avizo file; Amira or Avizo opens it"),
    MARK(0, "#?RADIANCE", "is a picture in the Radiance format, not a volume"),
    MARK(0, "ENVI",
         "is the header of an ENVI picture; give its numbers for the file beside it: "
         "`triptych brick FILE --size X,Y,Z --type uint8`"),
    MARK(0, "glTF", "is a glTF scene of meshes, not a volume; Blender opens it"),
    MARK(0, "LASF", "is a LAS or LAZ file of points, not a volume; CloudCompare opens it"),
    MARK(0, "ASTM-E57", "is an E57 file of scanned points, not a volume; CloudCompare opens it"),
    MARK(0, "NGSP", "is a scene of Gaussian splats (SPZ), not a volume" DESCRIBED),
    MARK(0, "\xff\xd8\xff",
         "is a JPEG picture; TIFF, PNG and EXR are read: ImageMagick converts it "
         "with `convert FILE FILE.png`"),
    MARK(0, "GIF8",
         "is a GIF picture; TIFF, PNG and EXR are read: ImageMagick converts it with "
         "`convert FILE FILE.png`"),
    MARK(8, "WEBP",
         "is a WebP picture; TIFF, PNG and EXR are read: ImageMagick converts it with "
         "`convert FILE FILE.png`"),
    MARK(0, "\0\0\0\x0cjP  \r\n\x87\n",
         "is a JPEG 2000 picture; TIFF, PNG and EXR are read: "
         "ImageMagick converts it with `convert FILE FILE.png`"),
    MARK(0, "%PDF-", "is a PDF document, not a volume"),
    MARK(4, "ftyp",
         "is a video or a picture in an MP4 container; ffmpeg makes a stack of pictures "
         "of a video: `ffmpeg -i FILE frame%04d.png`"),
    MARK(0, "\x1a\x45\xdf\xa3",
         "is a video (Matroska or WebM); ffmpeg makes a stack of pictures of "
         "it: `ffmpeg -i FILE frame%04d.png`"),
    MARK(8, "AVI ",
         "is a video (AVI); ffmpeg makes a stack of pictures of it: `ffmpeg -i FILE "
         "frame%04d.png`"),
    MARK(257, "ustar",
         "is a tar archive; unpack it with `tar -xf FILE`, then give a file or folder "
         "of it"),
    MARK(0, "7z\xbc\xaf\x27\x1c",
         "is a 7z archive; unpack it with `7z x FILE`, then give a file or "
         "folder of it"),
    MARK(0, "Rar!\x1a\x07", "is a RAR archive; unpack it, then give a file or folder of it"),
    MARK(0,
         "\xfd"
         "7zXZ\0",
         "is compressed with xz; unpack it first, with `xz -dc FILE >NAME`"),
    MARK(0, "\x28\xb5\x2f\xfd",
         "is compressed with zstd; unpack it first, with `zstd -dc FILE "
         ">NAME`"),
    MARK(0,
         "\x7f"
         "ELF",
         "is a program or a library, not a volume"),
    MARK(0, "SQLite format 3", "is an SQLite database, not a volume"),
};

/* ---- formats that need more than a mark ---- */

static bool is_blank(char c)
{
    return c == ' ' || c == '\t';
}

/* Returns the size of an element of a PLY header, or -1. */
static double ply_count(const char *head, const char *element)
{
    double count;
    char line[64];
    snprintf(line, sizeof line, "\nelement %s ", element);
    const char *at = strstr(head, line);
    return at && sscanf(at + strlen(line), "%lf", &count) == 1 ? count : -1;
}

/* Gaussian splats in glTF. Other tests tell meshes. */
static bool tell_gltf(const file *f)
{
    if ((!begins(f, "glTF") && !ends_in(f, ".gltf")) || !holds(f, "\"KHR_gaussian_splatting\""))
        return false;
    SAY("is a scene of Gaussian splats (glTF), not a volume" DESCRIBED);
    return true;
}

/* Tells meshes, points and Gaussian splats apart by the header. */
static bool tell_ply(const file *f)
{
    char head[TRIP_OTHER_HEAD_BYTES + 1];
    if (!begins(f, "ply\n") && !begins(f, "ply\r"))
        return false;
    const size_t bytes = f->bytes < TRIP_OTHER_HEAD_BYTES ? f->bytes : TRIP_OTHER_HEAD_BYTES;
    for (size_t i = 0; i < bytes; i++)
        head[i] = f->head[i] ? (char)f->head[i] : ' ';
    head[bytes] = 0;
    char *end = strstr(head, "end_header");
    if (end)
        *end = 0;
    const double points = ply_count(head, "vertex");
    if (strstr(head, " scale_0") || strstr(head, " rot_0") || strstr(head, " f_dc_0"))
        SAY("is a scene of %.0f Gaussian splats (PLY), not a volume" DESCRIBED, points);
    else if (strstr(head, "\nelement chunk ") && strstr(head, "packed_position"))
        SAY("is a compressed scene of Gaussian splats (PLY), not a volume" DESCRIBED);
    else if (ply_count(head, "face") > 0 || ply_count(head, "tristrips") > 0)
        SAY("is a mesh (PLY) of %.0f vertices, not a volume; MeshLab or ParaView opens it", points);
    else
        SAY("is a cloud of %.0f points (PLY), not a volume; CloudCompare or MeshLab opens it",
            points);
    return true;
}

/* A binary STL file has 84 bytes, then 50 for each triangle. */
static bool tell_stl(const file *f)
{
    struct stat st;
    const bool ascii = begins(f, "solid") && holds(f, "facet");
    const bool sized = f->bytes >= 84 && stat(f->path, &st) == 0 &&
                       (uint64_t)st.st_size == 84 + 50 * (uint64_t)number_at(f, 80);
    if (!ascii && !ends_in(f, ".stl") && !(sized && number_at(f, 80) > 0))
        return false;
    SAY("is a mesh (STL), not a volume; MeshLab or ParaView opens it");
    return true;
}

/* Type names of NumPy as `--type` takes them. */
static const char *type_of_numpy(const char *name, bool *swapped)
{
    static const struct {
        const char *numpy, *type;
    } names[] = {
        { "u1", "uint8" },  { "i1", "int8" },  { "u2", "uint16" }, { "i2", "int16" },
        { "u4", "uint32" }, { "i4", "int32" }, { "u8", "uint64" }, { "i8", "int64" },
        { "f2", "half" },   { "f4", "float" }, { "f8", "double" },
    };
    *swapped = *name == '>';
    for (size_t i = 0; i < sizeof names / sizeof *names && *name; i++)
        if (!strcmp(name + 1, names[i].numpy))
            return names[i].type;
    return NULL;
}

/* An array with three axes is raw data behind a header. */
static bool tell_numpy(const file *f)
{
    char head[TRIP_OTHER_HEAD_BYTES], name[8] = "", order[8] = "";
    int64_t n[4] = { 0 };
    bool swapped = false;
    if (!begins(f, "\x93NUMPY") || f->bytes < 12)
        return false;
    const bool wide = f->head[6] > 1;
    const size_t begin = wide ? 12 : 10;
    const size_t length = wide ? number_at(f, 8) : f->head[8] | (size_t)f->head[9] << 8;
    SAY("is a NumPy array (.npy); Python's numpy.load reads it, and its tofile() writes raw data");
    if (length >= sizeof head || begin + length > f->bytes)
        return true;
    memcpy(head, f->head + begin, length);
    head[length] = 0;
    const char *descr = strstr(head, "'descr': '"), *fortran = strstr(head, "'fortran_order': ");
    const char *shape = strstr(head, "'shape': (");
    if (!descr || !fortran || !shape || sscanf(descr + 10, "%7[^']", name) != 1 ||
        sscanf(fortran + 17, "%7[a-zA-Z]", order) != 1)
        return true;
    const int axes = sscanf(shape + 10, "%18" SCNd64 ", %18" SCNd64 ", %18" SCNd64 ", %18" SCNd64,
                            &n[0], &n[1], &n[2], &n[3]);
    const char *type = type_of_numpy(name, &swapped);
    const bool last_is_fastest = strcmp(order, "True") != 0;
    if (axes == 3 && type)
        SAY("is a NumPy array of %" PRId64 " x %" PRId64 " x %" PRId64 " (.npy); read it as raw "
            "data: `triptych brick FILE --size %" PRId64 ",%" PRId64 ",%" PRId64
            " --type %s --endian %s --offset %zu`",
            n[0], n[1], n[2], n[last_is_fastest ? 2 : 0], n[1], n[last_is_fastest ? 0 : 2], type,
            swapped ? "big" : "little", begin + length);
    return true;
}

/* A map of electron microscopy: raw data behind a header of 1024 bytes and more. */
static bool tell_mrc(const file *f)
{
    static const char *const types[] = { "int8", "int16", "float", NULL, NULL, NULL, "uint16" };
    if (!has_at(f, 208, "MAP", 3) || f->bytes < 1024)
        return false;
    const bool big = f->head[212] == 0x11;
    uint32_t n[4], more = number_at(f, 92);
    for (int i = 0; i < 4; i++)
        n[i] = number_at(f, 4 * (size_t)i);
    for (int i = 0; i < 4 && big; i++)
        n[i] = __builtin_bswap32(n[i]);
    more = big ? __builtin_bswap32(more) : more;
    if (n[3] < sizeof types / sizeof *types && types[n[3]])
        SAY("is an MRC or CCP4 map; UCSF ChimeraX opens it, or read it as raw data: `triptych "
            "brick "
            "FILE --size %u,%u,%u --type %s --endian %s --offset %" PRIu64 "`",
            n[0], n[1], n[2], types[n[3]], big ? "big" : "little", UINT64_C(1024) + more);
    else
        SAY("is an MRC or CCP4 map of another type than numbers; UCSF ChimeraX opens it");
    return true;
}

/* The header of Analyze 7.5 has no mark. Its first number is its size. */
static bool tell_analyze(const file *f)
{
    if (!ends_in(f, ".hdr") || f->bytes < 348 ||
        (number_at(f, 0) != 348 && __builtin_bswap32(number_at(f, 0)) != 348))
        return false;
    SAY("is an Analyze 7.5 header, whose orientation is not certain; convert it to NIfTI, for "
        "example with Python's nibabel");
    return true;
}

/* A cloud of points as text, or as binary data behind a text. */
static bool tell_pcd(const file *f)
{
    if (!begins(f, "# .PCD v") &&
        !(begins(f, "VERSION") && holds(f, "\nFIELDS ") && holds(f, "\nDATA ")))
        return false;
    SAY("is a cloud of points (PCD), not a volume; CloudCompare opens it");
    return true;
}

/* A curvilinear grid in PLOT3D begins with its size. Three floats a point, or four numbers and five
 * floats a point, follow. */
static bool tell_plot3d(const file *f)
{
    struct stat st;
    if (f->bytes < 28 || stat(f->path, &st) != 0)
        return false;
    for (int big = 0; big < 2; big++) {
        double points = 1;
        for (size_t i = 0; i < 3; i++)
            points *= big ? __builtin_bswap32(number_at(f, 4 * i)) : number_at(f, 4 * i);
        if (points > 1 &&
            ((double)st.st_size == 12 + 12 * points || (double)st.st_size == 28 + 20 * points)) {
            SAY("is a curvilinear grid or its values (PLOT3D), not a volume; ParaView opens it");
            return true;
        }
    }
    return false;
}

static bool tell_zip(const file *f)
{
    if (!begins(f, "PK\3\4") && !begins(f, "PK\5\6"))
        return false;
    if (ends_in(f, ".npz"))
        SAY("is an archive of NumPy arrays (.npz); Python's numpy.load reads them, and tofile() "
            "writes raw data");
    else if (ends_in(f, ".sog") || holds(f, "means_l.webp"))
        SAY("is a scene of Gaussian splats (SOG), not a volume" DESCRIBED);
    else
        SAY("is a ZIP archive; unpack it with `unzip FILE`, then give a file or folder of it");
    return true;
}

/* A program of Windows, or a picture with a short mark. */
static bool tell_short_marks(const file *f)
{
    if (begins(f, "MZ") && f->bytes >= 64)
        SAY("is a program for Windows, not a volume");
    else if (begins(f, "BM") && has_at(f, 6, "\0\0\0\0", 4))
        SAY("is a BMP picture; TIFF, PNG and EXR are read: ImageMagick converts it with `convert "
            "FILE FILE.png`");
    else
        return false;
    return true;
}

/* ---- text ---- */

static bool tell_vtk(const file *f)
{
    char kind[48] = "";
    const void *type = memmem(f->head, f->bytes, "<VTKFile", 8);
    if (begins(f, "# vtk DataFile")) {
        SAY("is legacy VTK; ParaView opens it%s",
            holds(f, "STRUCTURED_POINTS") ? ", and 3D Slicer saves such a volume as NRRD" : "");
        return true;
    }
    if (!type)
        return false;
    const size_t left = f->bytes - (size_t)((const unsigned char *)type - f->head);
    const char *at = memmem(type, left, "type=\"", 6);
    for (size_t i = 0; at && at + 6 + i < (const char *)f->head + f->bytes && i + 1 < sizeof kind &&
                       at[6 + i] != '"';
         i++)
        kind[i] = at[6 + i];
    SAY("is VTK XML (%.47s); ParaView opens it", kind);
    return true;
}

/* Returns whether most lines consist of `least` or more numbers. Blanks, commas and semicolons
 * separate numbers. */
static bool has_number_lines(const file *f, int least)
{
    int lines = 0, good = 0, numbers = 0;
    bool word = false, number = true;
    for (size_t i = 0; i < f->bytes; i++) {
        const char c = (char)f->head[i];
        const bool gap = is_blank(c) || c == ',' || c == ';' || c == '\r' || c == '\n';
        number = number && (gap || strchr("0123456789+-.eE", c));
        numbers += word && gap;
        word = !gap;
        if (c == '\n') {
            lines += numbers > 0;
            good += number && numbers >= least;
            numbers = 0;
            number = true;
        }
    }
    return good > 0 && 4 * good >= 3 * lines;
}

/* Returns whether every line of the first bytes begins with an event of a script or with #. */
static bool is_script(const file *f)
{
    static const char words[] = " move press release drag wheel key hold let type resize drop "
                                "minimise restore close wait sleep screenshot picture random "
                                "status set click ";
    int events = 0;
    for (size_t i = 0; i < f->bytes;) {
        const char *line = (const char *)f->head + i;
        const char *end = memchr(line, '\n', f->bytes - i);
        const size_t length = end ? (size_t)(end - line) : f->bytes - i;
        char word[16] = " ";
        size_t n = 0;
        while (n < length && n < 12 && line[n] >= 'a' && line[n] <= 'z')
            n++;
        memcpy(word + 1, line, n);
        word[n + 1] = ' ';
        const bool blank = length == 0 || line[0] == '#' || line[0] == '\r';
        const bool whole = end || f->bytes < TRIP_OTHER_HEAD_BYTES || length > sizeof word;
        if (!blank && whole &&
            (n == 0 || (n < length && !is_blank(line[n]) && line[n] != '\r') ||
             !strstr(words, word)))
            return false;
        events += !blank;
        i += length + 1;
    }
    return events > 0;
}

typedef struct text_kind {
    const char *suffix, *holds; /* either may be NULL */
    const char *text;
} text_kind;

#define POINTS "is a text of scanned points, not a volume; CloudCompare opens it"

static const text_kind texts[] = {
    { NULL, "ObjectType = Image",
      "is a MetaImage header; 3D Slicer or ITK-SNAP saves it as NRRD or "
      "NIfTI" },
    { ".mha", "NDims", "is a MetaImage file; 3D Slicer or ITK-SNAP saves it as NRRD or NIfTI" },
    { ".mhd", "NDims", "is a MetaImage header; 3D Slicer or ITK-SNAP saves it as NRRD or NIfTI" },
    { ".gltf", "\"asset\"", "is a glTF scene of meshes, not a volume; Blender opens it" },
    { ".obj", NULL, "is a mesh (OBJ), not a volume; MeshLab or Blender opens it" },
    { ".mtl", NULL, "lists materials of a mesh (OBJ), not a volume" },
    { ".off", NULL, "is a mesh (OFF), not a volume; MeshLab opens it" },
    { ".ptx", NULL, POINTS },
    { ".pts", NULL, POINTS },
    { ".pvd", NULL, "is a list of ParaView files; ParaView opens it" },
    { ".xdmf", NULL, "is XDMF, which describes arrays in HDF5; ParaView opens it" },
    { ".xmf", NULL, "is XDMF, which describes arrays in HDF5; ParaView opens it" },
    { NULL, "<!DOCTYPE html", "is a web page, not a volume" },
    { NULL, "<html", "is a web page, not a volume" },
};

static trip_other_kind tell_own_text(const file *f)
{
    if (holds(f, "\"triptych_path\"")) {
        SAY("is a camera path; `triptych render VOLUME --path FILE -o NAME.png` draws it");
        return TRIP_OTHER_PATH;
    }
    if (holds(f, "\"triptych_view\"")) {
        SAY("is a view that `triptych view` stored; it restores the view when it shows the data");
        return TRIP_OTHER_VIEW;
    }
    if (holds(f, "\"triptych_accuracy\"")) {
        SAY("is a report of `triptych accuracy`; `triptych render --error X` reads it beside its "
            "data");
        return TRIP_OTHER_REPORT;
    }
    const bool json = holds(f, "\"RGBPoints\"") || holds(f, "\"ColorSpace\"") ||
                      (ends_in(f, ".vp.json") && holds(f, "{"));
    const bool xml = holds(f, "<VolumeProperty") || holds(f, "<vtkMRMLVolumeProperty") ||
                     holds(f, "<VTKVolumeProperty") || holds(f, "<MRML");
    if (ends_in(f, ".tf") || ends_in(f, ".vp") || json || xml) {
        SAY("is a transfer function; --tf FILE draws with it, and `triptych tf show FILE` prints "
            "it");
        return TRIP_OTHER_FUNCTION;
    }
    if (begins(f, "{") && holds(f, "\"means\"") && holds(f, ".webp\"")) {
        SAY("is a scene of Gaussian splats (SOG), not a volume" DESCRIBED);
        return TRIP_OTHER_FOREIGN;
    }
    if (is_script(f)) {
        SAY("is a script for the viewer; `triptych view VOLUME --script FILE` replays it");
        return TRIP_OTHER_SCRIPT;
    }
    return TRIP_OTHER_UNKNOWN;
}

/* OBJ and OFF files are known by their first words as well. */
static bool tell_mesh_text(const file *f)
{
    const bool off = begins(f, "OFF\n") || begins(f, "OFF\r") || begins(f, "COFF") ||
                     begins(f, "NOFF") || begins(f, "OFF ");
    const bool obj = (holds(f, "\nv ") || begins(f, "v ")) &&
                     (holds(f, "\nf ") || holds(f, "\nvn ") || holds(f, "\nvt ") ||
                      holds(f, "\nmtllib ") || begins(f, "mtllib "));
    if (off)
        SAY("is a mesh (OFF), not a volume; MeshLab opens it");
    else if (obj)
        SAY("is a mesh (OBJ), not a volume; MeshLab or Blender opens it");
    return off || obj;
}

static trip_other_kind tell_text(const file *f)
{
    const trip_other_kind own = tell_own_text(f);
    if (own || tell_vtk(f))
        return own ? own : TRIP_OTHER_FOREIGN;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        if ((!texts[i].suffix || ends_in(f, texts[i].suffix)) &&
            (!texts[i].holds || holds(f, texts[i].holds))) {
            SAY("%s", texts[i].text);
            return TRIP_OTHER_FOREIGN;
        }
    if (tell_mesh_text(f))
        return TRIP_OTHER_FOREIGN;
    const bool table = ends_in(f, ".csv") || ends_in(f, ".tsv");
    if (!table && (ends_in(f, ".xyz") || ends_in(f, ".asc")) && has_number_lines(f, 3))
        SAY(POINTS);
    else if (table || has_number_lines(f, 2))
        SAY("is a table of numbers as text; NRRD holds such a volume with `encoding: ascii`");
    else
        SAY("is text, not a volume");
    return TRIP_OTHER_FOREIGN;
}

/* ---- folders, and names alone ---- */

static bool has_entry(const char *folder, const char *name)
{
    char path[4096];
    struct stat st;
    return snprintf(path, sizeof path, "%s/%s", folder, name) < (int)sizeof path &&
           stat(path, &st) == 0;
}

static bool tell_folder(const file *f)
{
    if (has_entry(f->path, ".zarray") || has_entry(f->path, ".zgroup") ||
        has_entry(f->path, "zarr.json"))
        SAY("is a Zarr store; Python's zarr or xarray reads it, and xarray writes netCDF");
    else if (has_entry(f->path, "system/controlDict"))
        SAY("is an OpenFOAM case; ParaView opens it");
    else
        return false;
    return true;
}

/* Binary formats without a mark. */
static bool tell_name(const file *f)
{
    static const struct {
        const char *suffix, *text;
    } names[] = {
        { ".splat", "is a scene of Gaussian splats (.splat), not a volume" DESCRIBED },
        { ".ksplat", "is a scene of Gaussian splats (.ksplat), not a volume" DESCRIBED },
        { ".3ds", "is a mesh (3DS), not a volume; Blender or MeshLab opens it" },
        { ".fbx", "is a scene of meshes (FBX), not a volume; Blender opens it" },
        { ".mat", "is a MATLAB file (v4); MATLAB, GNU Octave or Python's scipy.io reads it" },
    };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (ends_in(f, names[i].suffix)) {
            SAY("%s", names[i].text);
            return true;
        }
    return false;
}

static bool tell_marks(const file *f)
{
    for (size_t i = 0; i < sizeof marks / sizeof *marks; i++)
        if (has_at(f, marks[i].at, marks[i].bytes, marks[i].count)) {
            SAY("%s", marks[i].text);
            return true;
        }
    return false;
}

static trip_other_kind tell(const file *f)
{
    struct stat st;
    if (f->bytes == 0)
        return stat(f->path, &st) == 0 && S_ISDIR(st.st_mode) && tell_folder(f)
                   ? TRIP_OTHER_FOREIGN
                   : TRIP_OTHER_UNKNOWN;
    if (begins(f, "TRIPTYCH")) {
        SAY("is the index of a data set; give the folder that holds it");
        return TRIP_OTHER_INDEX;
    }
    if (tell_gltf(f) || tell_ply(f) || tell_numpy(f) || tell_mrc(f) || tell_pcd(f) || tell_zip(f) ||
        tell_marks(f) || tell_short_marks(f) || tell_analyze(f))
        return TRIP_OTHER_FOREIGN;
    if (is_text(f) && !(begins(f, "solid") && holds(f, "facet")))
        return tell_text(f);
    return tell_stl(f) || tell_name(f) || tell_plot3d(f) ? TRIP_OTHER_FOREIGN : TRIP_OTHER_UNKNOWN;
}

trip_other_kind trip_other_file_tell(const char *path, const unsigned char *head, size_t bytes,
                                     char text[TRIP_OTHER_TEXT_BYTES])
{
    file f = { .path = path, .stem = strlen(path), .head = head, .bytes = bytes, .text = text };
    *text = 0;
    if (ends_in(&f, ".gz"))
        f.stem -= 3;
    else if (ends_in(&f, ".bz2"))
        f.stem -= 4;
    return tell(&f);
}
