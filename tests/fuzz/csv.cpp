// SPDX-License-Identifier: MIT
// Any bytes as a CSV file, and files of boxes in all ways to write them, now and then with a lie. What is
// read is valid and is read again from the plainest file that says the same; without a lie it is what was
// written.
#include <charconv>
#include <cstdio>
#include <set>

#include "read_file.hpp"

namespace {

/// A file, and the boxes in it.
struct File
{
    std::string text;
    std::vector<jostle::Aabb3d> boxes; // z is 0 in 2D
    int dim;
    bool honest = true, valid = true;

    explicit File(fuzz::Input& in) : dim(in.below(2) == 0 ? 2 : 3), in_(in)
    {
        std::vector<std::string> columns = {"lo_x", "lo_y", "lo_z", "hi_x", "hi_y", "hi_z", "id"};
        if (in.below(2) == 0) columns.pop_back();
        if (dim == 2) std::erase_if(columns, [](const std::string& name) { return name.ends_with("_z"); });
        for (std::size_t k = 0; k + 1 < columns.size(); ++k)
            std::swap(columns[k], columns[k + in.below(static_cast<std::uint32_t>(columns.size() - k))]);
        if (in.one_in(4)) text = "\xef\xbb\xbf";
        row(columns);
        for (std::uint32_t rows = in.below(20); rows > 0; --rows) {
            jostle::Aabb3d box{};
            const auto read = in.box<3, double>(in.one_in(16));
            std::vector<std::string> fields;
            for (const std::string& name : columns)
                if (name == "id")
                    fields.push_back("box" + std::to_string(boxes.size()));
                else {
                    const int d = name[3] - 'x';
                    // Not (... ? lo : hi)[d]: g++ 12 with -fsanitize=bounds takes a wrong index there.
                    const auto& from = name[0] == 'l' ? read.lo : read.hi;
                    auto& side = name[0] == 'l' ? box.lo : box.hi;
                    side[d] = from[d];
                    fields.push_back(text_of(side[d], in_.below(8)));
                }
            row(fields);
            for (int d = 0; d < dim; ++d)
                valid &= box.lo[d] <= box.hi[d];
            boxes.push_back(box);
        }
        if (!in.one_in(8)) return;
        honest = false;
        for (std::uint32_t k = in.below(8); k > 0; --k)
            text[in.below(static_cast<std::uint32_t>(text.size()))] = in.number<char>();
    }

  private:
    /// In one of the ways to write a number, most often the shortest one, which is also the quickest.
    static std::string text_of(double number, std::uint32_t way)
    {
        char digits[40];
        if (way < 6) {
            const auto form = way < 4 ? std::chars_format::general : std::chars_format::scientific;
            return {digits, std::to_chars(digits, std::end(digits), number, form).ptr};
        }
        std::snprintf(digits, sizeof digits, way == 6 ? "%.17g" : "%+.17E", number);
        return digits;
    }
    void row(std::vector<std::string> fields)
    {
        if (in_.one_in(64)) { // one field too many
            honest = false;
            fields.push_back("0");
        }
        for (std::size_t k = 0; k < fields.size(); ++k) {
            const std::string& field = fields[k];
            text += k == 0 ? "" : ",";
            switch (in_.below(8)) {
            case 5:
                text += " " + field + "\t";
                break;
            case 6:
                text += '"' + field + '"';
                break;
            case 7:
                text += "\t\"" + field + "\" ";
                break;
            default:
                text += field;
            }
        }
        static const char* const ends[] = {"\n", "\r\n", "\r", "\n\n", "\n \r\n"};
        text += ends[in_.below(std::size(ends))];
    }
    fuzz::Input& in_;
};

} // namespace

JOSTLE_FUZZ_TARGET(csv)
{
    const bool raw = in.below(2) == 0;
    std::optional<File> made;
    if (!raw) made.emplace(in);
    const auto read = raw ? fuzz::read_or_refuse(in.rest(), jostle_tool::read_csv)
                          : fuzz::read_or_refuse(made->text, jostle_tool::read_csv);
    if (fuzz::telling() && made) fuzz::tell("R\"(" + made->text + ")\"");
    const bool honest = made && made->honest;
    if (!read) return fuzz::demand(!honest || !made->valid, "a file of good boxes is refused");
    fuzz::demand(!honest || made->valid, "a box that is none is taken");
    std::string plain;
    std::visit(
        [&](const auto& boxes) {
            using Box = typename std::decay_t<decltype(boxes)>::value_type;
            constexpr int dim = sizeof(Box::lo) / sizeof(typename decltype(Box::lo)::value_type);
            if (honest)
                fuzz::demand(boxes.size() == made->boxes.size() && dim == made->dim,
                             "another number of boxes");
            plain = dim == 2 ? "lo_x,lo_y,hi_x,hi_y" : "lo_x,lo_y,lo_z,hi_x,hi_y,hi_z";
            for (std::size_t i = 0; i < boxes.size(); ++i)
                for (const bool lower : {true, false})
                    for (int d = 0; d < dim; ++d) {
                        const double number = lower ? boxes[i].lo[d] : boxes[i].hi[d];
                        fuzz::demand(boxes[i].lo[d] <= boxes[i].hi[d], "a box that isn't valid was read");
                        if (honest)
                            fuzz::demand(number == (lower ? made->boxes[i].lo[d] : made->boxes[i].hi[d]),
                                         "another number than was written");
                        char digits[40];
                        plain += lower && d == 0 ? '\n' : ',';
                        plain.append(digits, std::to_chars(digits, std::end(digits), number).ptr);
                    }
            fuzz::count_boxes(boxes.size());
        },
        read->boxes);
    const auto again = fuzz::read_or_refuse(plain, jostle_tool::read_csv);
    fuzz::demand(again && fuzz::same_boxes(*read, *again), "a plain file of the same boxes reads as others");
    std::set<std::string_view> ids;
    for (std::size_t i = 0; i < read->ids.size(); ++i)
        fuzz::demand(ids.insert(read->ids[i]).second, "two boxes have one id");
}
