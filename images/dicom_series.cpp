#include "dicom_series.h"

#include <algorithm>
#include <limits>
#include <set>

namespace
{

/* Places closer than this part of the mean distance are one. */
constexpr double same_place = 0.01;

bool fits(const trip_dicom_ref &a, const trip_dicom_ref &b)
{
    const trip_dicom_file &f = *a.file, &g = *b.file;
    const trip_dicom_slice &s = *a.slice, &t = *b.slice;
    const std::vector<double> wide = { s.spacing[0] / t.spacing[0] - 1,
                                       s.spacing[1] / t.spacing[1] - 1 };
    return f.series == g.series && f.width == g.width && f.height == g.height &&
           f.type() == g.type() && f.tiles == g.tiles && s.segment == t.segment &&
           s.placed == t.placed && trip_dicom_alike(s.rows, t.rows) &&
           trip_dicom_alike(wide, { 0, 0 });
}

/* Copies of an object lie at one position, too, but are no further time. */
void drop_copies(std::vector<trip_dicom_ref> &slices)
{
    std::set<std::pair<std::string, std::pair<int64_t, int>>> known;
    std::set<const trip_dicom_file *> copies;
    std::vector<trip_dicom_ref> left;
    for (const trip_dicom_ref &r : slices) {
        const trip_vec3 &p = r.slice->position;
        const std::string key = r.file->object + ' ' + std::to_string(p.x) + ' ' +
                                std::to_string(p.y) + ' ' + std::to_string(p.z);
        if (r.file->object.empty() || !r.slice->placed ||
            known.insert({ key, { r.slice->frame, r.slice->tile } }).second)
            left.push_back(r);
        else
            copies.insert(r.file);
    }
    if (!copies.empty())
        trip_warn((*copies.begin())->path.c_str(),
                  copies.size() > 1
                      ? "is a copy of another file, as are %zu more; copies are left out"
                      : "is a copy of another file, and is left out",
                  copies.size() - 1);
    slices = left;
}

/* Sorts slices by their times, as far as both know them, and by their order in the list. */
bool is_earlier(const trip_dicom_ref &a, const trip_dicom_ref &b)
{
    for (int i = 0; i < 4; i++) {
        const double s = a.slice->times[i], t = b.slice->times[i];
        if (std::isfinite(s) && std::isfinite(t) && s != t)
            return s < t;
    }
    return false;
}

/* Puts slices with equal keys at one place. */
template <typename Key> void make_places(trip_dicom_series &s, const Key &key)
{
    std::vector<trip_dicom_ref> sorted = s.slices;
    std::stable_sort(
        sorted.begin(), sorted.end(),
        [&](const trip_dicom_ref &a, const trip_dicom_ref &b) { return key(a) < key(b); });
    const double range = key(sorted.back()) - key(sorted.front());
    const double close = same_place * range / std::max<double>((double)sorted.size() - 1, 1);
    for (const trip_dicom_ref &r : sorted) {
        if (s.places.empty() || key(r) - s.depths.back() > close) {
            s.places.emplace_back();
            s.depths.push_back(key(r));
        }
        s.places.back().push_back(r);
    }
    for (trip_dicom_place &place : s.places)
        std::stable_sort(place.begin(), place.end(), is_earlier);
}

/* Without positions, the order is the one of the instance numbers and of the frames. */
void number_places(trip_dicom_series &s)
{
    std::vector<trip_dicom_ref> sorted = s.slices;
    const bool numbered = std::all_of(sorted.begin(), sorted.end(), [](const trip_dicom_ref &r) {
        return std::isfinite(r.file->number);
    });
    if (numbered)
        std::stable_sort(sorted.begin(), sorted.end(),
                         [](const trip_dicom_ref &a, const trip_dicom_ref &b) {
                             return a.file->number < b.file->number;
                         });
    for (const trip_dicom_ref &r : sorted) {
        const trip_dicom_ref *before = s.places.empty() ? nullptr : &s.places.back()[0];
        if (numbered && before && before->file != r.file && before->file->number == r.file->number)
            throw trip_slice_error(r.file->path, "has the same instance number as " +
                                                     before->file->path + ", and no position");
        s.places.push_back({ r });
    }
}

void place_slices(trip_dicom_series &s)
{
    drop_copies(s.slices);
    const bool located = std::all_of(s.slices.begin(), s.slices.end(), [](const trip_dicom_ref &r) {
        return r.file->pixels.frames == 1 && std::isfinite(r.file->location);
    });
    if (s.placed()) {
        const trip_vec3 normal = s.slices[0].slice->normal();
        make_places(s,
                    [&](const trip_dicom_ref &r) { return trip_dot(r.slice->position, normal); });
    } else if (located) {
        make_places(s, [](const trip_dicom_ref &r) { return r.file->location; });
    } else {
        number_places(s);
    }
}

/* Returns whether the series numbers select one series each. */
bool are_distinct(const std::vector<trip_dicom_series> &all)
{
    std::set<double> numbers;
    for (const trip_dicom_series &s : all) {
        const double n = s.file().series_number;
        if (!(n >= 1 && n <= std::numeric_limits<int>::max() && n == std::floor(n)) ||
            !numbers.insert(n).second)
            return false;
    }
    return true;
}

void number_series(std::vector<trip_dicom_series> &all)
{
    std::stable_sort(all.begin(), all.end(),
                     [](const trip_dicom_series &a, const trip_dicom_series &b) {
                         return a.file().series_number < b.file().series_number;
                     });
    const bool distinct = are_distinct(all);
    for (size_t i = 0; i < all.size(); i++)
        all[i].number = distinct ? (int)all[i].file().series_number : (int)i + 1;
}

} // namespace

std::string trip_dicom_ref::name() const
{
    return file->path +
           (file->pixels.frames > 1 ? ": frame " + std::to_string(slice->frame + 1) : "");
}

size_t trip_dicom_series::times() const
{
    size_t most = 0;
    for (const trip_dicom_place &place : places)
        most = std::max(most, place.size());
    return most;
}

int64_t trip_dicom_series::voxels() const
{
    return file().width * file().height * (int64_t)places.size();
}

std::string trip_dicom_series::text() const
{
    const unsigned segment = slices[0].slice->segment;
    std::string name = file().description;
    if (segment && segment < file().segments.size())
        name += (name.empty() ? "" : ", ") + ("segment " + file().segments[segment]);
    std::string text = std::to_string(number) + (name.empty() ? "" : " \"" + name + "\"") + " (" +
                       file().modality + (file().modality.empty() ? "" : ", ") +
                       std::to_string(file().width) + " x " + std::to_string(file().height) +
                       " x " + std::to_string(places.size());
    if (times() > 1)
        text += ", " + std::to_string(times()) + " times";
    return text + ")";
}

std::vector<trip_dicom_series> trip_dicom_sort(const std::vector<trip_dicom_file> &files)
{
    std::vector<trip_dicom_series> all;
    size_t last = 0; /* most slices belong to the series of the slice before */
    for (const trip_dicom_file &file : files)
        for (const trip_dicom_slice &slice : file.slices) {
            const trip_dicom_ref ref = { &file, &slice };
            if (last >= all.size() || !fits(ref, all[last].slices[0]))
                for (last = 0; last < all.size() && !fits(ref, all[last].slices[0]);)
                    last++;
            if (last == all.size())
                all.emplace_back();
            all[last].slices.push_back(ref);
        }
    for (trip_dicom_series &s : all)
        place_slices(s);
    number_series(all);
    return all;
}
