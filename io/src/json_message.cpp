// SPDX-License-Identifier: MIT
#include <bevel/io/json_message.hpp>

namespace bevel::io {

void JsonLayout::add(const char* name, JsonColumn::Kind kind) {
  const char* opening = columns_.empty() ? "{\"" : ",\"";
  JsonColumn& column = columns_.emplace_back();
  column.name = name;
  column.kind = kind;
  column.key = std::string(opening) + name + "\":";
  if (kind == JsonColumn::Kind::seen) column.unseen_key = std::string(opening) + "unseen_" + name + "\":";
  largest_size_ += std::max(column.key.size(), column.unseen_key.size()) + JsonWriter::kLongestNumber;
}

std::string JsonLayout::schema() const {
  std::string properties, required;
  const auto add = [&](const std::string& name, const char* type, bool is_required) {
    properties += (properties.empty() ? "\"" : ",\"") + name + "\":{\"type\":\"" + type + "\"}";
    if (is_required) required += (required.empty() ? "\"" : ",\"") + name + "\"";
  };
  for (const JsonColumn& column : columns_) {
    const bool is_seen = column.kind == JsonColumn::Kind::seen;
    add(column.name, column.kind == JsonColumn::Kind::whole ? "integer" : "number", !is_seen);
    if (is_seen) add("unseen_" + column.name, "number", false);
  }
  return "{\"type\":\"object\",\"properties\":{" + properties + "},\"required\":[" + required + "]}";
}

}  // namespace bevel::io
