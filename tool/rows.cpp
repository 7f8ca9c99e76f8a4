// SPDX-License-Identifier: MIT
#include "rows.hpp"

#include <charconv>
#include <cstddef>

#include <nlohmann/json.hpp>

#include "numbers.hpp"

namespace jostle_tool {

namespace {

std::string in_brackets(const std::vector<std::string>& rows)
{
    std::string text = "[\n";
    for (std::size_t i = 0; i < rows.size(); ++i)
        text += rows[i] + (i + 1 < rows.size() ? ",\n" : "\n");
    return text + "]\n";
}

} // namespace

JsonRow::Value::Value(double number) : text(nlohmann::json(number).dump()) {}

JsonRow::Value::Value(float number)
{
    char digits[32];
    const char* const end = std::to_chars(digits, digits + sizeof digits, number).ptr;
    double shortest = 0;
    std::from_chars(digits, end, shortest);
    text = Value(shortest).text;
}

JsonRow::Value::Value(const std::string& value) : text(nlohmann::json(value).dump()) {}

JsonRow::JsonRow(std::initializer_list<Member> members)
{
    for (const auto& [name, value] : members)
        set(name, value);
}

void JsonRow::set(const std::string& name, const Value& value)
{
    members_ += (members_.empty() ? "" : ",") + Value(name).text + ":" + value.text;
}

RowsFile::RowsFile(const std::string& name) : beside_table_(name != "-")
{
    if (!name.empty()) file_.emplace(name);
}

void RowsFile::write()
{
    if (!file_) return;
    file_->write(in_brackets(rows_));
    file_->commit();
}

JsonRow row_of(const std::vector<std::pair<std::string, double>>& times)
{
    JsonRow row;
    for (const auto& [name, time] : times)
        row.set(name, rounded(time));
    return row;
}

std::string indented(const std::vector<JsonRow>& rows)
{
    std::vector<std::string> texts;
    for (const JsonRow& row : rows)
        texts.push_back(row.text());
    return nlohmann::ordered_json::parse(in_brackets(texts)).dump(1);
}

} // namespace jostle_tool
