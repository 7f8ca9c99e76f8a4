// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include <fast_float/fast_float.h>

#include "boxes.hpp"
#include "input_file.hpp"
#include "tool/commands.hpp"
#include "tool/progress.hpp"
#include "tool/text.hpp"

namespace jostle_tool {

namespace {

/// Reads records of comma-separated fields: RFC 4180, and also spaces around fields, blank lines, any line
/// ends, and a byte order mark. One record is in memory at a time.
class CsvReader
{
  public:
    explicit CsvReader(InputFile& file)
        : file_(file),
          buffer_(std::clamp<std::uint64_t>(file.size().value_or(largest_buffer), 4096, largest_buffer)),
          progress_("reading " + file_.name(), file_.size().value_or(0))
    {
        for (const char expected : {'\xef', '\xbb', '\xbf'}) // UTF-8's byte order mark
            if (peek() == static_cast<unsigned char>(expected)) ++next_;
        // UTF-16's, which spreadsheets and PowerShell write. UTF-8 has no such bytes.
        if (peek() == 0xff || peek() == 0xfe) fail(0, "the file is UTF-16 text; save it as UTF-8");
    }

    /// Goes to the next record that isn't blank; false at the end of the file.
    bool next()
    {
        for (;;) {
            if (peek() == end_of_file) return false;
            if (!read_record()) continue;
            return true;
        }
    }

    [[nodiscard]] std::size_t fields() const noexcept { return ends_.size(); }
    [[nodiscard]] std::string_view field(std::size_t i) const noexcept
    {
        const std::size_t begin = i == 0 ? 0 : ends_[i - 1];
        return std::string_view(text_).substr(begin, ends_[i] - begin);
    }

    /// `what` goes wrong in field `column` of this record.
    [[noreturn]] void fail(std::size_t column, const std::string& what) const
    {
        throw UsageError(file_.name() + ":" + std::to_string(record_line_) + ":" +
                         std::to_string(column + 1) + ": " + what);
    }

  private:
    static constexpr int end_of_file = -1;
    static constexpr std::size_t longest_record = std::size_t{1} << 20;
    static constexpr std::uint64_t largest_buffer = std::uint64_t{1} << 18;

    int peek()
    {
        if (next_ == filled_) {
            if (ended_) return end_of_file;
            progress_.step(filled_);
            next_ = 0;
            filled_ = file_.read(buffer_.data(), buffer_.size());
            if (filled_ == 0) {
                ended_ = true;
                return end_of_file;
            }
        }
        return static_cast<unsigned char>(buffer_[next_]);
    }

    bool at_field_end()
    {
        const int c = peek();
        return c == ',' || c == '\n' || c == '\r' || c == end_of_file;
    }

    void skip_spaces()
    {
        for (int c; (c = peek()) == ' ' || c == '\t';)
            ++next_;
    }

    void add(const char* bytes, std::size_t count)
    {
        check_length(count);
        text_.append(bytes, count);
    }

    void check_length(std::size_t more) const
    {
        if (text_.size() + ends_.size() + more > longest_record)
            fail(ends_.size(), "the row is longer than a megabyte; is this a CSV file?");
    }

    /// All that is left of a field without quotes, as much at a time as the buffer holds.
    void read_plain()
    {
        while (!at_field_end()) { // which fills the buffer
            const char* const first = buffer_.data() + next_;
            const char* const last = std::find_if(first, std::as_const(buffer_).data() + filled_,
                                                  [](char c) { return c == ',' || c == '\n' || c == '\r'; });
            add(first, static_cast<std::size_t>(last - first));
            next_ += static_cast<std::size_t>(last - first);
        }
    }

    /// False if the record is a blank line.
    bool read_record()
    {
        text_.clear();
        ends_.clear();
        record_line_ = line_;
        bool quoted = false;
        for (;;) {
            skip_spaces();
            if (peek() == '"') {
                quoted = true;
                read_quoted();
            } else {
                const std::size_t begin = text_.size();
                read_plain();
                while (text_.size() > begin && (text_.back() == ' ' || text_.back() == '\t'))
                    text_.pop_back();
            }
            check_length(1); // a row of commas alone as well
            ends_.push_back(text_.size());
            const int c = peek();
            if (c != end_of_file) ++next_;
            if (c == ',') continue;
            if (c == '\r' && peek() == '\n') ++next_;
            ++line_;
            return quoted || ends_.size() > 1 || !text_.empty();
        }
    }

    void read_quoted()
    {
        for (++next_;; ++next_) {
            const int c = peek();
            if (c == end_of_file) fail(ends_.size(), "the quote is never closed; add the missing \"");
            if (c == '"') {
                ++next_;
                if (peek() != '"') break; // "" stands for one "
            }
            if (c == '\n') ++line_;
            const char byte = static_cast<char>(c);
            add(&byte, 1);
        }
        skip_spaces();
        if (!at_field_end())
            fail(ends_.size(), "text follows a closing quote; put a comma there, or double the quote");
    }

    InputFile& file_;
    std::vector<char> buffer_;
    std::size_t next_ = 0, filled_ = 0;
    bool ended_ = false;
    std::uint64_t line_ = 1, record_line_ = 1;
    std::string text_; // the fields of this record, one after another
    std::vector<std::size_t> ends_;
    Progress progress_;
};

constexpr const char* header_advice =
    "the first line may name the columns: lo_x,lo_y[,lo_z],hi_x,hi_y[,hi_z], or xmin,..., or "
    "x,y[,z],w,h[,d], "
    "and maybe id, in any order; without names there are 4 or 6 columns in the first of these orders";
constexpr std::size_t none = ~std::size_t{0};

/// What a column has of a box. An axis has two: `lo`, and `hi` or what has to be added to `lo`.
enum Bound
{
    lo,
    hi,
    extent
};
constexpr std::size_t bounds = 3;

std::string own_name(Bound bound, std::size_t axis)
{
    if (bound == extent) return std::string(1, "whd"[axis]);
    return std::string(bound == lo ? "lo_" : "hi_") + "xyz"[axis];
}

/// Our own names, and those that spreadsheets, GeoPandas and detectors of images write.
bool is_name(const std::string& name, Bound bound, std::size_t axis)
{
    if (name == own_name(bound, axis)) return true;
    if (bound == extent) return false;
    const std::string end = bound == lo ? "min" : "max", a(1, "xyz"[axis]);
    return name == end + a || name == a + end || name == end + "_" + a || name == a + "_" + end ||
           (bound == lo && name == a);
}

struct Column
{
    std::size_t place = none;
    std::string name; ///< as the file has it
};

struct Header
{
    Column of[bounds][3];
    std::size_t id = none;
    std::size_t columns = 0;
    bool named = true; ///< else the first line is a box

    [[nodiscard]] bool has(Bound bound, std::size_t axis) const { return of[bound][axis].place != none; }
    [[nodiscard]] int dimension() const { return has(lo, 2) || has(hi, 2) || has(extent, 2) ? 3 : 2; }
};

/// A number at the beginning of the text, and where it ends: null if there is none.
const char* parse(std::string_view text, double& value)
{
    const char* first = text.data();
    const char* const last = first + text.size();
    // from_chars takes no plus sign. "+-1" stays an error.
    if (text.size() > 1 && text[0] == '+' && text[1] != '-' && text[1] != '+') ++first;
    const auto result = fast_float::from_chars(first, last, value);
    return result.ec == std::errc::invalid_argument ? nullptr : result.ptr;
}

double number(const CsvReader& csv, const Column& column)
{
    const std::string_view text = csv.field(column.place);
    if (text.empty()) csv.fail(column.place, column.name + " is empty; write a number");
    double value;
    if (parse(text, value) != text.data() + text.size())
        csv.fail(column.place, column.name + " is " + quote(text) +
                                   ", which is not a number; write one like -12.5, 1e-3 or inf");
    if (std::isinf(value) && text.find_first_of("0123456789") != std::string_view::npos)
        csv.fail(column.place,
                 column.name + " is " + quote(text) +
                     ", which is more than a double can hold; write inf if it is meant to be unbounded");
    if (std::isnan(value))
        csv.fail(column.place, column.name + " is NaN; every bound must be a number (inf is allowed)");
    return value;
}

bool all_numbers(const CsvReader& csv)
{
    for (std::size_t i = 0; i < csv.fields(); ++i) {
        double ignored;
        const std::string_view text = csv.field(i);
        if (parse(text, ignored) != text.data() + text.size()) return false;
    }
    return true;
}

Header read_header(CsvReader& csv)
{
    if (!csv.next()) csv.fail(0, std::string("the file is empty; ") + header_advice);
    Header header;
    header.columns = csv.fields();
    if (all_numbers(csv)) {
        header.named = false;
        if (header.columns != 4 && header.columns != 6)
            csv.fail(0, "there is no line with names, and " + std::to_string(header.columns) +
                            (header.columns == 1 ? " column; " : " columns; ") + header_advice);
        const std::size_t axes = header.columns / 2;
        for (std::size_t i = 0; i < header.columns; ++i)
            header.of[i < axes ? lo : hi][i % axes] = {i, own_name(i < axes ? lo : hi, i % axes)};
        return header;
    }
    for (std::size_t i = 0; i < csv.fields(); ++i) {
        std::string name(csv.field(i));
        for (char& c : name)
            if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
        std::size_t* place = name == "id" ? &header.id : nullptr;
        for (const Bound bound : {lo, hi, extent})
            for (std::size_t axis = 0; axis < 3; ++axis)
                if (is_name(name, bound, axis)) {
                    place = &header.of[bound][axis].place;
                    header.of[bound][axis].name = name;
                }
        if (place == nullptr)
            csv.fail(i, "column " + quote(csv.field(i)) + " is not known; " + header_advice);
        if (*place != none) csv.fail(i, "column " + name + " is there twice; remove one");
        *place = i;
    }
    for (const Bound bound : {lo, hi})
        for (std::size_t axis = 0; axis < static_cast<std::size_t>(header.dimension()); ++axis) {
            const bool sized = header.has(extent, axis);
            if (bound == hi && sized && header.has(hi, axis))
                csv.fail(std::max(header.of[hi][axis].place, header.of[extent][axis].place),
                         "columns " + header.of[hi][axis].name + " and " + header.of[extent][axis].name +
                             " say the same; remove one");
            if (!header.has(bound, axis) && !(bound == hi && sized))
                csv.fail(csv.fields(), "column " + own_name(bound, axis) + " is missing; " + header_advice);
        }
    return header;
}

/// The bounds of a box along one axis.
std::pair<double, double> read_bounds(const CsvReader& csv, const Header& header, std::size_t axis)
{
    const Column& low = header.of[lo][axis];
    const bool sized = header.has(extent, axis);
    const Column& high = header.of[sized ? extent : hi][axis];
    const double from = number(csv, low), other = number(csv, high);
    if (!sized) {
        if (from > other)
            csv.fail(low.place, low.name + " = " + shortened(csv.field(low.place)) + " is greater than " +
                                    high.name + " = " + shortened(csv.field(high.place)) +
                                    "; swap them or drop the box");
        return {from, other};
    }
    if (other < 0)
        csv.fail(high.place, high.name + " = " + shortened(csv.field(high.place)) +
                                 " is below 0; a box begins at " + low.name + " and has this size");
    const double to = from + other;
    if (std::isnan(to) || (std::isinf(to) && !std::isinf(from) && !std::isinf(other)))
        csv.fail(high.place, low.name + " + " + high.name +
                                 " is no number that a double can hold; write the upper bound as hi_" +
                                 "xyz"[axis]);
    return {from, to};
}

template <int Dim>
BoxSet read_rows(CsvReader& csv, const Header& header)
{
    BoxSet set;
    std::vector<jostle::Aabb<Dim, double>> boxes;
    for (bool here = !header.named; here || csv.next(); here = false) {
        if (csv.fields() != header.columns)
            csv.fail(std::min(csv.fields(), header.columns),
                     "the row has " + std::to_string(csv.fields()) + " fields and the " +
                         (header.named ? "header " : "first ") + std::to_string(header.columns) +
                         "; give each column one value");
        if (boxes.size() == ~std::uint32_t{0})
            csv.fail(0, "more boxes than 32 bits can number; split the file");
        jostle::Aabb<Dim, double> box;
        for (std::size_t d = 0; d < Dim; ++d)
            std::tie(box.lo[d], box.hi[d]) = read_bounds(csv, header, d);
        if (header.id != none) {
            const std::string_view id = csv.field(header.id);
            if (id.empty()) csv.fail(header.id, "id is empty; name the box, or leave the column out");
            if (const auto earlier = set.ids.add(id))
                csv.fail(header.id, "id " + quote(id) + " already names box " + std::to_string(*earlier) +
                                        " (the first is 0); make them differ, or leave the column out");
        }
        boxes.push_back(box);
    }
    set.boxes = std::move(boxes);
    return set;
}

} // namespace

BoxSet read_csv(InputFile& file)
{
    CsvReader csv(file);
    const Header header = read_header(csv);
    return header.dimension() == 2 ? read_rows<2>(csv, header) : read_rows<3>(csv, header);
}

} // namespace jostle_tool
