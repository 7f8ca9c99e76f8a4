// SPDX-License-Identifier: MIT
// NumPy's .npy: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
#include <algorithm>
#include <bit>
#include <cstring>

#include "boxes.hpp"
#include "input_file.hpp"
#include "tool/commands.hpp"
#include "tool/progress.hpp"
#include "tool/text.hpp"

namespace jostle_tool {

namespace {

struct Header
{
    std::string descr;
    bool fortran_order = false;
    std::vector<std::uint64_t> shape;
};

/// The header is a Python dictionary of exactly three entries, as repr() writes it.
class HeaderParser
{
  public:
    HeaderParser(const std::string& path, std::string_view text) : path_(path), rest_(text) {}

    Header parse()
    {
        Header header;
        bool seen[3] = {};
        expect('{');
        while (!accept('}')) {
            const std::string key = string();
            expect(':');
            const std::size_t which = key == "descr"           ? 0
                                      : key == "fortran_order" ? 1
                                      : key == "shape"         ? 2
                                                               : 3;
            if (which == 3 || seen[which]) fail();
            seen[which] = true;
            if (which == 0) {
                skip_spaces();
                if (rest_.substr(0, 1) == "[")
                    throw UsageError(path_ +
                                     ": is an array of records; save plain float32 or float64 numbers, "
                                     "of shape (n, 4) or (n, 6)");
                header.descr = string();
            } else if (which == 1) {
                header.fortran_order = boolean();
            } else {
                header.shape = tuple();
            }
            if (!accept(',')) {
                expect('}');
                break;
            }
        }
        skip_spaces();
        if (!rest_.empty() || !seen[0] || !seen[1] || !seen[2]) fail();
        return header;
    }

  private:
    [[noreturn]] void fail() const
    {
        throw UsageError(path_ + ": the NPY header is damaged; save the array again with numpy.save");
    }
    void skip_spaces() { rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size())); }
    bool accept(char c)
    {
        skip_spaces();
        if (rest_.empty() || rest_.front() != c) return false;
        rest_.remove_prefix(1);
        return true;
    }
    void expect(char c)
    {
        if (!accept(c)) fail();
    }
    std::string string()
    {
        const char mark = accept('\'') ? '\'' : '"';
        if (mark == '"') expect('"');
        const std::size_t size = rest_.find(mark);
        if (size == std::string_view::npos) fail();
        std::string text(rest_.substr(0, size));
        rest_.remove_prefix(size + 1);
        return text;
    }
    bool boolean()
    {
        skip_spaces();
        for (const std::string_view word : {"False", "True"})
            if (rest_.substr(0, word.size()) == word) {
                rest_.remove_prefix(word.size());
                return word == "True";
            }
        fail();
    }
    std::vector<std::uint64_t> tuple()
    {
        std::vector<std::uint64_t> values;
        expect('(');
        while (!accept(')')) {
            skip_spaces();
            const std::size_t digits = std::min(rest_.find_first_not_of("0123456789"), rest_.size());
            if (digits == 0 || digits > 18) fail();
            values.push_back(std::stoull(std::string(rest_.substr(0, digits))));
            rest_.remove_prefix(digits);
            if (rest_.substr(0, 1) == "L") rest_.remove_prefix(1); // Python 2 wrote 3L
            if (!accept(',')) {
                expect(')');
                break;
            }
        }
        return values;
    }

    const std::string& path_;
    std::string_view rest_;
};

std::string python_tuple(const std::vector<std::uint64_t>& values)
{
    std::string text = "(";
    for (std::size_t i = 0; i < values.size(); ++i)
        text += (i == 0 ? "" : ", ") + std::to_string(values[i]);
    return text + (values.size() == 1 ? ",)" : ")");
}

class NpyFile
{
  public:
    explicit NpyFile(InputFile& file) : file_(file) {}

    Header read_header()
    {
        // NumPy itself writes some hundred bytes and refuses more than 10,000.
        constexpr std::uint64_t longest = std::uint64_t{1} << 20;
        unsigned char start[12] = {};
        if (!fill(start, 8)) fail_short();
        if (std::memcmp(start, "\x93NUMPY", 6) != 0)
            throw UsageError(file_.name() + ": doesn't start as an NPY file does; save it with numpy.save");
        const int version = start[6];
        if (version < 1 || version > 3)
            throw UsageError(file_.name() + ": is NPY version " + std::to_string(version) +
                             "; versions 1, 2 and 3 are known");
        const std::size_t length_bytes = version == 1 ? 2 : 4;
        if (!fill(start + 8, length_bytes)) fail_short();
        std::uint64_t length = 0;
        for (std::size_t i = length_bytes; i-- > 0;)
            length = length << 8 | start[8 + i];
        if (length > longest)
            throw UsageError(file_.name() +
                             ": the NPY header is longer than a megabyte; save the array again "
                             "with numpy.save");
        std::string text(length, ' ');
        if (!fill(text.data(), text.size())) fail_short();
        return HeaderParser(file_.name(), text).parse();
    }

    /// How many bytes there are after the header. Where only the end can tell, as of a pipe, this keeps them
    /// until they are read, but no more than one over `expected`: that is too many already.
    std::uint64_t left(std::uint64_t expected)
    {
        if (file_.size()) return *file_.size() - std::min(*file_.size(), read_);
        constexpr std::uint64_t step = std::uint64_t{1} << 20;
        while (kept_.size() <= expected) {
            const std::size_t before = kept_.size();
            kept_.resize(before + std::min(step, expected + 1 - before));
            const std::size_t got = file_.read(kept_.data() + before, kept_.size() - before);
            kept_.resize(before + got);
            if (got == 0) break;
        }
        return kept_.size();
    }

    void read(void* to, std::size_t bytes)
    {
        if (file_.size()) {
            if (!fill(to, bytes))
                throw UsageError(file_.name() + ": ended while it was read; check the file");
            return;
        }
        std::memcpy(to, kept_.data() + taken_, bytes); // left() has seen that there are as many
        taken_ += bytes;
    }

  private:
    /// False if the file ends before.
    bool fill(void* to, std::size_t bytes)
    {
        for (char* next = static_cast<char*>(to); bytes > 0;) {
            const std::size_t got = file_.read(next, bytes);
            if (got == 0) return false;
            next += got;
            bytes -= got;
            read_ += got;
        }
        return true;
    }

    [[noreturn]] void fail_short() const
    {
        throw UsageError(file_.name() + ": ends inside the NPY header; save the array again with numpy.save");
    }

    InputFile& file_;
    std::uint64_t read_ = 0;
    std::vector<char> kept_;
    std::size_t taken_ = 0; // of what is kept
};

template <class T>
void swap_bytes(T* values, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i) {
        auto* bytes = reinterpret_cast<unsigned char*>(values + i);
        std::reverse(bytes, bytes + sizeof(T));
    }
}

template <int Dim, class T>
std::vector<jostle::Aabb<Dim, T>> read_values(NpyFile& file, const std::string& path, std::uint64_t boxes,
                                              const Header& header, bool swap)
{
    constexpr std::size_t per_box = 2 * Dim;
    constexpr std::size_t per_read = (std::size_t{1} << 16) * per_box;
    static_assert(sizeof(jostle::Aabb<Dim, T>) == per_box * sizeof(T));
    std::vector<jostle::Aabb<Dim, T>> result(boxes);
    T* const values = reinterpret_cast<T*>(result.data()); // row after row: lo of a box, then its hi
    Progress progress("reading " + path, boxes * per_box);
    if (!header.fortran_order) {
        for (std::size_t done = 0; done < boxes * per_box;) {
            const std::size_t count = std::min(per_read, boxes * per_box - done);
            file.read(values + done, count * sizeof(T));
            if (swap) swap_bytes(values + done, count);
            done += count;
            progress.step(count);
        }
        return result;
    }
    // One coordinate of all boxes after another, the last index slowest: in an array of shape (n, 2, d) lo.x,
    // hi.x, lo.y, ..., in one of shape (n, 2 * d) lo.x, lo.y, ...
    const bool nested = header.shape.size() == 3;
    std::vector<T> column(std::min<std::size_t>(per_read, boxes));
    for (std::size_t c = 0; c < per_box; ++c) {
        const std::size_t place = nested ? c % 2 * Dim + c / 2 : c;
        for (std::size_t done = 0; done < boxes;) {
            const std::size_t count = std::min(column.size(), static_cast<std::size_t>(boxes) - done);
            file.read(column.data(), count * sizeof(T));
            if (swap) swap_bytes(column.data(), count);
            for (std::size_t i = 0; i < count; ++i)
                values[(done + i) * per_box + place] = column[i];
            done += count;
            progress.step(count);
        }
    }
    return result;
}

} // namespace

BoxSet read_npy(InputFile& from)
{
    const std::string& path = from.name();
    NpyFile file(from);
    const Header header = file.read_header();
    const auto& shape = header.shape;
    const bool flat = shape.size() == 2 && (shape[1] == 4 || shape[1] == 6);
    const bool nested = shape.size() == 3 && shape[1] == 2 && (shape[2] == 2 || shape[2] == 3);
    if (!flat && !nested)
        throw UsageError(path + ": has shape " + shortened(python_tuple(shape)) +
                         "; n boxes in d dimensions (2 or 3) are (n, 2, d) or (n, 2 * d), lo before hi");
    const std::string type = header.descr.empty() ? "" : header.descr.substr(1);
    const char byte_order = header.descr.empty() ? ' ' : header.descr[0];
    if ((type != "f4" && type != "f8") || (byte_order != '<' && byte_order != '>' && byte_order != '='))
        throw UsageError(path + ": has numbers of type " + quote(header.descr) +
                         "; convert them with .astype('float32') or .astype('float64')");
    const bool swap =
        byte_order != '=' && (byte_order == '<') != (std::endian::native == std::endian::little);

    const std::uint64_t boxes = shape[0];
    if (boxes > ~std::uint32_t{0})
        throw UsageError(path + ": has more boxes than 32 bits can number; split it");
    const int dimension = static_cast<int>(flat ? shape[1] / 2 : shape[2]);
    const std::uint64_t bytes = boxes * 2 * static_cast<std::uint64_t>(dimension) * (type == "f4" ? 4 : 8);
    const std::uint64_t left = file.left(bytes);
    if (left != bytes) // before any memory is asked for: a damaged header may name any size
        throw UsageError(path + ": shape " + python_tuple(shape) + " of " + header.descr + " needs " +
                         std::to_string(bytes) + " bytes and the file has " + std::to_string(left) + "; " +
                         (left < bytes ? "it is cut off, save it again" : "save one array per file"));

    BoxSet set;
    const auto read = [&]<int Dim, class T>(jostle::Aabb<Dim, T>*) {
        set.boxes = read_values<Dim, T>(file, path, boxes, header, swap);
    };
    if (dimension == 2)
        type == "f4" ? read((jostle::Aabb2f*)nullptr) : read((jostle::Aabb2d*)nullptr);
    else
        type == "f4" ? read((jostle::Aabb3f*)nullptr) : read((jostle::Aabb3d*)nullptr);
    return set;
}

} // namespace jostle_tool
