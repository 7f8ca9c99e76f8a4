// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
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

constexpr std::array<const char*, 6> coordinate_names = {"lo_x", "lo_y", "lo_z", "hi_x", "hi_y", "hi_z"};
constexpr const char* header_advice =
    "the first line must name the columns: lo_x,lo_y[,lo_z],hi_x,hi_y[,hi_z] and maybe id, in any order";
constexpr std::size_t none = ~std::size_t{0};

struct Header
{
    std::array<std::size_t, 6> column; // of each of coordinate_names, or none
    std::size_t id = none;
    std::size_t columns = 0;
    [[nodiscard]] int dimension() const { return column[2] == none && column[5] == none ? 2 : 3; }
};

Header read_header(CsvReader& csv)
{
    if (!csv.next()) csv.fail(0, std::string("the file is empty; ") + header_advice);
    Header header;
    header.column.fill(none);
    header.columns = csv.fields();
    for (std::size_t i = 0; i < csv.fields(); ++i) {
        std::string name(csv.field(i));
        for (char& c : name)
            if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
        std::size_t* place = name == "id" ? &header.id : nullptr;
        for (std::size_t c = 0; c < coordinate_names.size(); ++c)
            if (name == coordinate_names[c]) place = &header.column[c];
        if (place == nullptr)
            csv.fail(i, "column " + quote(csv.field(i)) + " is not known; " + header_advice);
        if (*place != none) csv.fail(i, "column " + name + " is there twice; remove one");
        *place = i;
    }
    for (std::size_t c = 0; c < coordinate_names.size(); ++c)
        if (header.column[c] == none && (c % 3 != 2 || header.dimension() == 3))
            csv.fail(csv.fields(),
                     std::string("column ") + coordinate_names[c] + " is missing; " + header_advice);
    return header;
}

double number(const CsvReader& csv, std::size_t column, const char* name)
{
    const std::string_view text = csv.field(column);
    if (text.empty()) csv.fail(column, std::string(name) + " is empty; write a number");
    const char* first = text.data();
    const char* last = first + text.size();
    // from_chars takes no plus sign. "+-1" stays an error.
    if (text.size() > 1 && text[0] == '+' && text[1] != '-' && text[1] != '+') ++first;
    double value;
    const auto result = fast_float::from_chars(first, last, value);
    if (result.ec == std::errc::invalid_argument || result.ptr != last)
        csv.fail(column, std::string(name) + " is " + quote(text) +
                             ", which is not a number; write one like -12.5, 1e-3 or inf");
    if (std::isinf(value) && text.find_first_of("0123456789") != std::string_view::npos)
        csv.fail(column,
                 std::string(name) + " is " + quote(text) +
                     ", which is more than a double can hold; write inf if it is meant to be unbounded");
    if (std::isnan(value))
        csv.fail(column, std::string(name) + " is NaN; every bound must be a number (inf is allowed)");
    return value;
}

template <int Dim>
BoxSet read_rows(CsvReader& csv, const Header& header)
{
    BoxSet set;
    std::vector<jostle::Aabb<Dim, double>> boxes;
    while (csv.next()) {
        if (csv.fields() != header.columns)
            csv.fail(std::min(csv.fields(), header.columns),
                     "the row has " + std::to_string(csv.fields()) + " fields and the header " +
                         std::to_string(header.columns) + "; give each column one value");
        if (boxes.size() == ~std::uint32_t{0})
            csv.fail(0, "more boxes than 32 bits can number; split the file");
        jostle::Aabb<Dim, double> box;
        for (std::size_t d = 0; d < Dim; ++d) {
            const std::size_t lo = header.column[d], hi = header.column[3 + d];
            box.lo[d] = number(csv, lo, coordinate_names[d]);
            box.hi[d] = number(csv, hi, coordinate_names[3 + d]);
            if (box.lo[d] > box.hi[d])
                csv.fail(lo, std::string(coordinate_names[d]) + " = " + shortened(csv.field(lo)) +
                                 " is greater than " + coordinate_names[3 + d] + " = " +
                                 shortened(csv.field(hi)) + "; swap them or drop the box");
        }
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
