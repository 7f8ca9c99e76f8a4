// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/output_file.hpp"

/// Measurements as JSON. Only rows.cpp and what reads JSON include the library for it.

namespace jostle_tool {

/// An object; its members stand in the order in which they were set.
class JsonRow
{
  public:
    /// What a member may be, as JSON's text.
    struct Value
    {
        template <std::integral Number>
        Value(Number number) : text(std::to_string(number))
        {
        }
        Value(bool value) : text(value ? "true" : "false") {}
        Value(std::nullptr_t) : text("null") {}
        Value(double number);
        Value(float number); ///< as few digits as tell it from all other floats
        Value(const char* value) : Value(std::string(value)) {}
        Value(const std::string& value);
        Value(const JsonRow& row) : text(row.text()) {}

        std::string text;
    };
    using Member = std::pair<std::string, Value>;

    JsonRow() = default;
    JsonRow(std::initializer_list<Member> members);
    void set(const std::string& name, const Value& value);
    [[nodiscard]] std::string text() const { return "{" + members_ + "}"; }

  private:
    std::string members_;
};

/// The file of --json: rows, one a line, which versions and compares well.
class RowsFile
{
  public:
    /// Before the work: a file that can't be written is said at once. Nothing is written if `name` is empty.
    explicit RowsFile(const std::string& name);
    /// Whether stdout is free for a table.
    [[nodiscard]] bool beside_table() const noexcept { return beside_table_; }
    void add(const JsonRow& row) { add_text(row.text()); }
    /// A row that is JSON already.
    void add_text(std::string row) { rows_.push_back(std::move(row)); }
    /// After the last row.
    void write();

  private:
    bool beside_table_;
    std::optional<OutputFile> file_;
    std::vector<std::string> rows_;
};

/// Times by name.
[[nodiscard]] JsonRow row_of(const std::vector<std::pair<std::string, double>>& times);

/// Rows with one member a line.
[[nodiscard]] std::string indented(const std::vector<JsonRow>& rows);

} // namespace jostle_tool
