#include "replay/record_file.h"

#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <stdexcept>

namespace mbcosim::replay {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

std::string text_of(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

bool same(double a, double b, double tolerance) {
  if (std::memcmp(&a, &b, sizeof a) == 0) return true;
  return tolerance > 0 && std::abs(a - b) <= tolerance * std::max(std::abs(a), std::abs(b));
}

std::string differs(const std::string& where, const std::string& recorded, const std::string& now) {
  return where + ": recorded " + recorded + ", now " + now;
}

std::optional<std::string> compare_numbers(const Message& a, const Message& b,
                                           const FieldDescriptor* field, double tolerance) {
  const auto* ra = a.GetReflection();
  const auto* rb = b.GetReflection();
  const int count = ra->FieldSize(a, field);
  if (count != rb->FieldSize(b, field))
    return differs("length of " + field->name(), std::to_string(count),
                   std::to_string(rb->FieldSize(b, field)));
  for (int k = 0; k < count; ++k) {
    const double x = ra->GetRepeatedDouble(a, field, k), y = rb->GetRepeatedDouble(b, field, k);
    if (!same(x, y, tolerance))
      return differs(field->name() + "[" + std::to_string(k) + "]", text_of(x), text_of(y));
  }
  return std::nullopt;
}

std::optional<std::string> compare_field(const Message& a, const Message& b,
                                         const FieldDescriptor* field, double tolerance) {
  if (field->is_repeated() && field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE)
    return compare_numbers(a, b, field, tolerance);
  const auto* ra = a.GetReflection();
  const auto* rb = b.GetReflection();
  if (!field->is_repeated() && field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
    const double x = ra->GetDouble(a, field), y = rb->GetDouble(b, field);
    if (same(x, y, tolerance)) return std::nullopt;
    return differs(field->name(), text_of(x), text_of(y));
  }
  if (!field->is_repeated() && field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
    if (ra->HasField(a, field) != rb->HasField(b, field))
      return differs(field->name(), ra->HasField(a, field) ? "present" : "absent",
                     rb->HasField(b, field) ? "present" : "absent");
    if (!ra->HasField(a, field)) return std::nullopt;
    return first_difference(ra->GetMessage(a, field), rb->GetMessage(b, field), tolerance);
  }
  if (!field->is_repeated() && field->cpp_type() == FieldDescriptor::CPPTYPE_INT64 &&
      ra->GetInt64(a, field) != rb->GetInt64(b, field))
    return differs(field->name(), std::to_string(ra->GetInt64(a, field)),
                   std::to_string(rb->GetInt64(b, field)));
  if (!field->is_repeated() && field->cpp_type() == FieldDescriptor::CPPTYPE_INT32 &&
      ra->GetInt32(a, field) != rb->GetInt32(b, field))
    return differs(field->name(), std::to_string(ra->GetInt32(a, field)),
                   std::to_string(rb->GetInt32(b, field)));
  if (!field->is_repeated() && field->cpp_type() == FieldDescriptor::CPPTYPE_BOOL &&
      ra->GetBool(a, field) != rb->GetBool(b, field))
    return differs(field->name(), ra->GetBool(a, field) ? "yes" : "no",
                   rb->GetBool(b, field) ? "yes" : "no");
  if (!field->is_repeated() && field->cpp_type() == FieldDescriptor::CPPTYPE_STRING &&
      ra->GetString(a, field) != rb->GetString(b, field))
    return differs(field->name(), "\"" + ra->GetString(a, field) + "\"",
                   "\"" + rb->GetString(b, field) + "\"");
  return std::nullopt;
}

}  // namespace

std::optional<std::string> first_difference(const Message& recorded, const Message& now,
                                            double tolerance) {
  const auto* type = recorded.GetDescriptor();
  for (int k = 0; k < type->field_count(); ++k)
    if (auto difference = compare_field(recorded, now, type->field(k), tolerance))
      return difference;
  return std::nullopt;
}

std::vector<v1::RecordEntry> read_record(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read the record \"" + path + "\"");
  google::protobuf::io::IstreamInputStream in(&file);
  std::vector<v1::RecordEntry> entries;
  for (bool end = false; !end;) {
    v1::RecordEntry entry;
    if (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&entry, &in, &end))
      entries.push_back(std::move(entry));
    else if (!end)
      throw std::runtime_error("\"" + path + "\" is damaged after " +
                               std::to_string(entries.size()) + " entries");
  }
  if (entries.empty() || !entries.front().has_header())
    throw std::runtime_error("\"" + path + "\" is no record: its header is missing");
  return entries;
}

}  // namespace mbcosim::replay
