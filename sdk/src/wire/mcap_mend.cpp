// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/wire/mcap_mend.hpp>
#include <striper/wire/mcap_reader.hpp>

namespace striper::wire {
namespace {

void copy_extras(McapReader& reader, McapWriter& writer, McapMended& mended) {
  for (const McapMetadata& metadata : reader.metadata()) {
    writer.add_metadata(metadata);
    ++mended.metadata;
  }
  for (std::size_t i = 0; i < reader.attachments().size(); ++i) {
    try {
      writer.attach(reader.read_attachment(i));
      ++mended.attachments;
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::kBadFile) throw;
      ++mended.damaged_records;
      mended.first_damage = error.what();
    }
  }
}

void copy_messages(McapReader& reader, McapWriter& writer, McapMended& mended) {
  std::map<std::uint16_t, std::uint16_t> numbers;
  for (McapMessage message; reader.next(message); ++mended.messages) {
    const auto [number, is_new] = numbers.try_emplace(message.channel);
    if (is_new) number->second = writer.add_channel(reader.channels().at(message.channel));
    message.channel = number->second;
    writer.write(message);
  }
}

}  // namespace

McapMended mend_mcap(const std::filesystem::path& broken, const std::filesystem::path& whole,
                     McapWriterOptions options) {
  std::error_code ignored;
  if (std::filesystem::equivalent(broken, whole, ignored)) {
    throw Error(
        ErrorKind::kUsage,
        fmt::format("{}: a file cannot be mended into itself; name another", whole.string()));
  }
  McapReader reader(broken, {.skip_damaged = true});
  options.profile = reader.profile();
  McapWriter writer(whole, options);
  McapMended mended;
  copy_extras(reader, writer, mended);
  copy_messages(reader, writer, mended);
  writer.close();
  mended.damaged_records += reader.damaged_records();
  if (!reader.first_damage().empty()) mended.first_damage = reader.first_damage();
  mended.was_cut = reader.end() == McapEnd::kCut;
  return mended;
}

}  // namespace striper::wire
