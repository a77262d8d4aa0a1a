#include "slice_files.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <map>

namespace
{

constexpr size_t max_digits = 18;

bool is_digit(char c)
{
    return isdigit((unsigned char)c) != 0;
}

/* Splits the last part of a path into alternating texts and digits: text, digits, text, ..., text.
 */
std::vector<std::string> split_name(const std::string &path)
{
    size_t slash = path.rfind('/');
    std::vector<std::string> parts(1);
    for (size_t i = slash == std::string::npos ? 0 : slash + 1; i < path.size(); i++) {
        bool in_digits = parts.size() % 2 == 0;
        if (is_digit(path[i]) != in_digits)
            parts.emplace_back();
        parts.back() += path[i];
    }
    if (parts.size() % 2 == 0)
        parts.emplace_back();
    return parts;
}

using Parts = std::vector<std::string>;

/* Returns the index of the only number that differs, or 0. */
size_t find_counter(const std::vector<Parts> &names)
{
    size_t counter = 0;
    for (size_t at = 1; at < names[0].size(); at += 2) {
        bool differs = false;
        for (const Parts &parts : names)
            differs = differs || parts[at] != names[0][at];
        if (differs && counter)
            return 0;
        counter = differs ? at : counter;
    }
    return counter;
}

struct Numbered {
    long long number;
    const Parts *parts;
};

std::vector<Numbered> numbers_of(const std::vector<Parts> &names, size_t counter)
{
    std::vector<Numbered> numbered;
    for (const Parts &parts : names) {
        if (parts[counter].size() > max_digits)
            return {};
        numbered.push_back({ std::atoll(parts[counter].c_str()), &parts });
    }
    std::sort(numbered.begin(), numbered.end(),
              [](const Numbered &a, const Numbered &b) { return a.number < b.number; });
    return numbered;
}

/* Returns the name of a missing slice, with leading zeros like its neighbour. */
std::string name_with(const Numbered &neighbour, size_t counter, long long number)
{
    std::string name;
    for (size_t at = 0; at < neighbour.parts->size(); at++) {
        std::string digits = std::to_string(number);
        size_t width = (*neighbour.parts)[at].size();
        if (at == counter && digits.size() < width)
            digits.insert(0, width - digits.size(), '0');
        name += at == counter ? digits : (*neighbour.parts)[at];
    }
    return name;
}

void report_gap(const std::string &path, const std::string &stage, bool allow_gaps)
{
    if (!allow_gaps)
        throw trip_slice_error(path, stage + "; --allow-gaps lets its neighbours touch");
    trip_warn(path.c_str(), "%s; its neighbours are drawn as if they touched", stage.c_str());
}

void check_one_shape(const std::string &path, const std::vector<Parts> &names, bool allow_gaps)
{
    size_t counter = find_counter(names);
    const std::vector<Numbered> all =
        counter ? numbers_of(names, counter) : std::vector<Numbered>();
    if (all.size() < 2)
        return;
    long long step = all.size() == 2 ? 1 : all[1].number - all[0].number;
    for (size_t i = 1; i < all.size(); i++)
        step = std::min(step, all[i].number - all[i - 1].number);
    unsigned long long missing = 0;
    const Numbered *before = nullptr;
    for (size_t i = 1; i < all.size() && step > 0; i++) {
        long long apart = all[i].number - all[i - 1].number;
        missing += (unsigned long long)((apart - 1) / step);
        if (apart != step && !before)
            before = &all[i - 1];
    }
    if (!before)
        return;
    long long number = before->number + step;
    std::string stage = "slice " + std::to_string(number) + " is missing (" +
                        name_with(*before, counter, number) + ")";
    if (missing > 1)
        stage += ", and " + std::to_string(missing - 1) + " more";
    report_gap(path, stage, allow_gaps);
}

} // namespace

std::string trip_name_shape(const std::string &name)
{
    std::string shape;
    const Parts parts = split_name(name);
    for (size_t at = 0; at < parts.size(); at++)
        shape += at % 2 ? "1" : parts[at];
    return shape;
}

void trip_check_numbers(const std::string &path, const std::vector<std::string> &names,
                        bool allow_gaps)
{
    std::map<std::string, std::vector<Parts>> shapes;
    for (const std::string &name : names)
        shapes[trip_name_shape(name)].push_back(split_name(name));
    for (const auto &shape : shapes)
        check_one_shape(path, shape.second, allow_gaps);
}

/* Returns how many of the steps beside it a step is long, if that is a whole number of at least 2
 * on all sides, else 0. */
static long steps_within(const std::vector<double> &steps, size_t i)
{
    long whole = 0;
    for (size_t side : { i - 1, i + 1 }) {
        if (side >= steps.size())
            continue;
        const double times = steps[i] / steps[side], near = std::round(times);
        if (!(near >= 2 && near < 1e6 && std::fabs(times - near) <= 0.1))
            return 0;
        whole = (long)near;
    }
    return whole;
}

void trip_check_positions(const std::vector<double> &positions,
                          const std::vector<std::string> &names, bool allow_gaps)
{
    std::vector<double> steps;
    for (size_t i = 1; i < positions.size(); i++)
        steps.push_back(positions[i] - positions[i - 1]);
    for (size_t i = 0; i < steps.size(); i++) {
        const long whole = steps_within(steps, i);
        if (!whole)
            continue;
        const std::string text = "a slice is missing after it: the next slice, " + names[i + 1] +
                                 ", is " + std::to_string(whole) + " steps away";
        if (!allow_gaps)
            throw trip_slice_error(names[i],
                                   text + "; --allow-gaps draws the others where they are");
        trip_warn(names[i].c_str(), "%s; values in between are interpolated", text.c_str());
        return;
    }
}
