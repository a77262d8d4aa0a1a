/* Puts the slices of DICOM files in order, as one volume. */
#include <algorithm>
#include <cstdio>
#include <cstring>

#include <dirent.h>

#include "connection.h"
#include "dicom_series.h"
#include "slice_stack.h"

namespace
{

/* Distances between slices that differ by less than this part of their mean count as even. The
 * positions in files are rounded. */
constexpr double even_steps = 0.05;

/* Lists of series in notes name at most this many. */
constexpr size_t named_series = 4;

std::string base_name(const std::string &path)
{
    const size_t slash = path.rfind('/');
    return slash == std::string::npos ? path : path.substr(slash + 1);
}

/* Reads the headers of all files and moves those without pixels to `without`. */
std::vector<trip_dicom_file> read_files(const trip_slice_files &files,
                                        std::vector<std::string> &without)
{
    std::vector<trip_dicom_file> read;
    for (const std::string &name : files.names) {
        trip_dicom_file file;
        if (base_name(name) != "DICOMDIR") /* GDCM fails to read some of them */
            file = trip_dicom_read(name);
        trip_connection_working();
        if (file.has_pixels)
            read.push_back(std::move(file));
        else
            without.push_back(name);
    }
    if (read.empty())
        throw trip_slice_error(files.names[0],
                               files.names.size() == 1
                                   ? "holds no pixels; it is a report, a plan or a directory"
                                   : "holds no pixels, and neither do the other DICOM files there; "
                                     "slices may be in folders beside it");
    return read;
}

std::string list_series(const std::vector<trip_dicom_series> &all, const trip_dicom_series *except,
                        size_t most)
{
    std::string list;
    size_t count = 0;
    for (const trip_dicom_series &s : all)
        if (&s != except && count++ < most)
            list += (list.empty() ? "" : ", ") + s.text();
    return list + (count > most ? ", and " + std::to_string(count - most) + " more" : "");
}

/* Chooses the series with that number, or the largest one if the number is 0. */
const trip_dicom_series &choose_series(const std::string &path,
                                       const std::vector<trip_dicom_series> &all, int number)
{
    const trip_dicom_series *chosen = nullptr;
    for (const trip_dicom_series &s : all)
        if (number ? s.number == number : !chosen || s.voxels() > chosen->voxels())
            chosen = &s;
    if (!chosen)
        throw trip_slice_error(path,
                               "has no series " + std::to_string(number) + "; it has " +
                                   list_series(all, nullptr, SIZE_MAX),
                               TRIP_USAGE);
    return *chosen;
}

/* Returns one slice for each place, at one time. Places without this time are left out. */
std::vector<trip_dicom_ref> choose_time(const std::string &path, const trip_dicom_series &series,
                                        size_t time, std::vector<double> &depths)
{
    std::vector<trip_dicom_ref> slices;
    for (size_t i = 0; i < series.places.size(); i++) {
        const trip_dicom_place &place = series.places[i];
        if (time >= place.size())
            continue;
        slices.push_back(place[time]);
        if (!series.depths.empty())
            depths.push_back(series.depths[i]);
    }
    if (slices.empty())
        throw trip_slice_error(path,
                               "has no time " + std::to_string(time) + "; its times are 0 to " +
                                   std::to_string(series.times() - 1),
                               TRIP_USAGE);
    return slices;
}

/* Checks that slices lie on one straight line, so that they are sheets of one grid, sheared if the
 * gantry was tilted. A deviation of more than half a pixel is an error. */
void check_line(const std::vector<trip_dicom_ref> &slices, trip_vec3 normal, trip_vec3 step,
                double pixel)
{
    const double along = trip_dot(step, normal);
    for (size_t i = 1; i < slices.size(); i++) {
        trip_vec3 way = trip_sub(slices[i].slice->position, slices[0].slice->position);
        double steps = trip_dot(way, normal) / along;
        double aside = trip_length(trip_sub(way, trip_scale(step, steps)));
        if (!(aside <= 0.5 * pixel)) {
            char text[200];
            std::snprintf(text, sizeof text,
                          "slice %zu of its series lies %.3g beside the line through the first and "
                          "the last; such slices form no grid",
                          i + 1, aside);
            throw trip_slice_error(slices[0].name(), text);
        }
    }
}

/* Returns the mean step between slices in space, from their positions if known, else from the
 * stated location or spacing. */
trip_vec3 mean_step(const std::vector<trip_dicom_ref> &slices, const std::vector<double> &depths,
                    trip_vec3 normal)
{
    const trip_dicom_slice &first = *slices.front().slice, &last = *slices.back().slice;
    const double count = (double)slices.size() - 1;
    if (first.placed && count > 0) {
        const trip_vec3 step = trip_scale(trip_sub(last.position, first.position), 1 / count);
        check_line(slices, normal, step, std::max(first.spacing[0], first.spacing[1]));
        return step;
    }
    if (!depths.empty() && count > 0)
        return trip_scale(normal, (depths.back() - depths.front()) / count);
    return trip_scale(normal, std::isfinite(first.step) ? first.step : 1);
}

trip_affine make_map(const std::vector<trip_dicom_ref> &slices, const std::vector<double> &depths)
{
    const trip_dicom_slice &s = *slices[0].slice;
    const bool oriented = !s.rows.empty();
    trip_vec3 i = trip_v3(1, 0, 0), j = trip_v3(0, 1, 0);
    if (oriented) {
        i = trip_normalize(trip_v3(s.rows[0], s.rows[1], s.rows[2]));
        j = trip_normalize(trip_v3(s.rows[3], s.rows[4], s.rows[5]));
    }
    const trip_vec3 k = mean_step(slices, depths, trip_normalize(trip_cross(i, j)));
    trip_affine map;
    for (int r = 0; r < 3; r++) {
        map.m[r][0] = trip_component(i, r) * s.spacing[0];
        map.m[r][1] = trip_component(j, r) * s.spacing[1];
        map.m[r][2] = trip_component(k, r);
        map.m[r][3] = trip_component(s.position, r);
    }
    return map;
}

/* Returns whether the slices are uneven. Sets the least and the greatest distance. */
bool are_uneven(const std::vector<double> &depths, double &least, double &most)
{
    const double mean =
        depths.size() < 3 ? 0 : (depths.back() - depths[0]) / ((double)depths.size() - 1);
    bool uneven = false;
    least = INFINITY, most = 0;
    for (size_t k = 1; k < depths.size(); k++) {
        least = std::min(least, depths[k] - depths[k - 1]);
        most = std::max(most, depths[k] - depths[k - 1]);
        uneven = uneven || std::fabs(depths[k] - depths[0] - mean * (double)k) > even_steps * mean;
    }
    return mean > 0 && uneven;
}

/* Counts the other files of a folder that belong to a slice's series. */
size_t count_others(const trip_dicom_file &file)
{
    const size_t slash = file.path.rfind('/');
    const std::string folder = slash == std::string::npos ? "." : file.path.substr(0, slash + 1);
    std::unique_ptr<DIR, int (*)(DIR *)> dir(::opendir(folder.c_str()), ::closedir);
    size_t count = 0;
    while (struct dirent *entry = dir ? ::readdir(dir.get()) : nullptr) {
        const std::string name = entry->d_name;
        const std::string path = slash == std::string::npos ? name : folder + name;
        if (name[0] == '.' || path == file.path || !trip_slice_is_dicom(path))
            continue;
        count += trip_dicom_is_of_series(path, file.series);
        trip_connection_working();
    }
    return count;
}

class DicomStack : public trip_slice_stack
{
  public:
    DicomStack(const std::string &path, const trip_slice_files &files, trip_budget *budget,
               const trip_stack_choice &choice);
    void read(int64_t k, void *values) override;

  private:
    void choose(const std::string &path, const trip_stack_choice &choice);
    void add_note(const std::string &text);
    void note_choices(const trip_dicom_series &series, int time);
    void place(const std::vector<double> &depths);
    void set_values();

    std::vector<trip_dicom_file> files_;
    std::vector<trip_dicom_ref> slices_;
    trip_dicom_reader reader_;
    trip_scalar stored_ = TRIP_U8;
    trip_slice_buffer slice_;
};

void DicomStack::add_note(const std::string &text)
{
    note += (note.empty() ? "" : "; ") + text;
}

void DicomStack::note_choices(const trip_dicom_series &series, int time)
{
    if (series.times() > 1 && !time)
        add_note("time 0 of " + std::to_string(series.times()) +
                 " (--time N selects another, from 0)");
    double least, most;
    std::vector<double> depths = series.depths;
    if (series.placed() && are_uneven(depths, least, most)) {
        char text[100];
        std::snprintf(text, sizeof text,
                      "slices lie %.4g to %.4g apart, and are drawn where they are", least, most);
        add_note(text);
    }
}

void DicomStack::choose(const std::string &path, const trip_stack_choice &choice)
{
    const std::vector<trip_dicom_series> all = trip_dicom_sort(files_);
    const trip_dicom_series &series = choose_series(path, all, choice.series);
    std::vector<double> depths;
    std::vector<std::string> names;
    for (const trip_dicom_series &s : all)
        parts += s.text() + "\n";
    if (all.size() > 1 && !choice.series)
        add_note("series " + series.text() + ", the largest of " + std::to_string(all.size()) +
                 " (--series N selects another: " + list_series(all, &series, named_series) + ")");
    slices_ = choose_time(path, series, (size_t)choice.time, depths);
    for (const trip_dicom_ref &r : slices_)
        names.push_back(r.name());
    trip_check_positions(depths, names, choice.allow_gaps);
    note_choices(series, choice.time);
    place(depths);
}

/* Sets the map and the positions of the slices. */
void DicomStack::place(const std::vector<double> &depths)
{
    const trip_dicom_slice &first = *slices_[0].slice;
    double least, most;
    index_to_world = make_map(slices_, depths);
    oriented = !first.rows.empty();
    if (first.placed && slices_[0].file->biped)
        std::strcpy(space, "LPS");
    if (are_uneven(depths, least, most))
        along = depths;
}

/* Chooses the type of the values. */
void DicomStack::set_values()
{
    const trip_dicom_file &file = *slices_[0].file;
    const trip_dicom_rescale &first = slices_[0].slice->rescale;
    const bool alike = std::all_of(slices_.begin(), slices_.end(), [&](const trip_dicom_ref &r) {
        return r.slice->rescale == first;
    });
    const bool colour = file.pixels.colour != trip_dicom_colour::GREY;
    if (colour)
        trip_warn(file.path.c_str(), "is in colour; its Rec. 709 luma is read");
    if (file.has_table)
        trip_warn(file.path.c_str(), "has a table of values (Modality LUT), which is not applied");
    stored_ = file.type();
    type = alike || colour ? stored_ : TRIP_F32;
    slope = alike && !colour ? first.slope : 1;
    inter = alike && !colour ? first.inter : 0;
}

DicomStack::DicomStack(const std::string &path, const trip_slice_files &files, trip_budget *budget,
                       const trip_stack_choice &choice)
{
    std::vector<std::string> without;
    files_ = read_files(files, without);
    choose(path, choice);
    if (!without.empty())
        add_note(std::to_string(without.size()) + " DICOM object" +
                 (without.size() > 1 ? "s" : "") + " without pixels passed over: " +
                 base_name(without[0]) + (without.size() > 1 ? ", ..." : ""));
    const trip_dicom_file &file = *slices_[0].file;
    std::snprintf(modality, sizeof modality, "%s", file.modality.c_str());
    dims[0] = file.width;
    dims[1] = file.height;
    dims[2] = (int64_t)slices_.size();
    set_values();
    const trip_dicom_ref largest = *std::max_element(
        slices_.begin(), slices_.end(), [](const trip_dicom_ref &a, const trip_dicom_ref &b) {
            return a.file->pixels.frame_bytes() < b.file->pixels.frame_bytes();
        });
    reader_.reserve(budget, *largest.file);
    if (type != stored_)
        slice_.take(budget, file.path,
                    (uint64_t)(file.width * file.height) * trip_scalar_bytes(stored_));
    if (files.names.size() == 1 && files.names[0] == path && file.slices.size() == 1 &&
        !file.series.empty()) {
        const size_t others = count_others(file);
        if (others)
            add_note("one slice of a series; its folder holds " + std::to_string(others) +
                     " more: give the folder to draw all of them");
    }
}

void DicomStack::read(int64_t k, void *values)
{
    const trip_dicom_ref &r = slices_[(size_t)k];
    if (type == stored_)
        return reader_.read(*r.file, *r.slice, values);
    reader_.read(*r.file, *r.slice, slice_.data());
    trip_scalar_decode(stored_, false, r.slice->rescale.slope, r.slice->rescale.inter,
                       slice_.data(), (size_t)(dims[0] * dims[1]), (float *)values);
}

} // namespace

std::unique_ptr<trip_slice_stack> trip_dicom_stack(const std::string &path,
                                                   const trip_slice_files &files,
                                                   trip_budget *budget,
                                                   const trip_stack_choice &choice)
{
    return std::unique_ptr<trip_slice_stack>(new DicomStack(path, files, budget, choice));
}
