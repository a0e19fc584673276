// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/wire/mcap_copy.hpp>

namespace striper::wire {
namespace {

class Copy {
 public:
  Copy(McapReader& reader, McapWriter& writer, const McapSelection& selection)
      : reader_(reader), writer_(writer), selection_(selection) {}

  McapCopied run() {
    copy_extras();
    copy_messages();
    copied_.was_cut = reader_.end() == McapEnd::kCut;
    const auto& damages = reader_.damages();
    copied_.damages.insert(copied_.damages.end(), damages.begin(), damages.end());
    return std::move(copied_);
  }

 private:
  bool is_wanted(std::string_view name) const {
    return !selection_.extra || selection_.extra(name);
  }

  void copy_extras() {
    for (const McapMetadata& metadata : reader_.metadata()) {
      if (!is_wanted(metadata.name)) continue;
      writer_.add_metadata(metadata);
      ++copied_.metadata;
    }
    for (std::size_t i = 0; i < reader_.attachments().size(); ++i) copy_attachment(i);
  }

  void copy_attachment(std::size_t index) {
    if (!is_wanted(reader_.attachments()[index].name)) return;
    try {
      writer_.attach(reader_.read_attachment(index));
      ++copied_.attachments;
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::kBadFile) throw;
      copied_.damages.push_back({0, 0, error.what()});
    }
  }

  void copy_messages() {
    for (McapMessage message; !copied_.was_stopped && reader_.next(message);) {
      const McapChannel& channel = reader_.channels().at(message.channel);
      if (!selection_.message || selection_.message(channel, message)) write(channel, message);
      copied_.was_stopped = selection_.go_on && !selection_.go_on(reader_.whole_bytes());
    }
  }

  void write(const McapChannel& channel, McapMessage message) {
    const auto [number, is_new] = numbers_.try_emplace(message.channel);
    if (is_new) number->second = writer_.add_channel(channel);
    message.channel = number->second;
    writer_.write(message);
    ++copied_.messages;
  }

  McapReader& reader_;
  McapWriter& writer_;
  const McapSelection& selection_;
  std::map<std::uint16_t, std::uint16_t> numbers_;  // Of channels, theirs to ours.
  McapCopied copied_;
};

}  // namespace

McapCopied copy_mcap(const std::filesystem::path& from, const std::filesystem::path& to,
                     const McapSelection& selection, McapWriterOptions options) {
  std::error_code ignored;
  if (std::filesystem::equivalent(from, to, ignored)) {
    throw Error(ErrorKind::kUsage,
                fmt::format("{}: a file cannot be copied into itself; name another", to.string()));
  }
  McapReader reader(from, {.skip_damaged = true});
  options.profile = reader.profile();
  McapWriter writer(to, options);
  McapCopied copied = Copy(reader, writer, selection).run();
  writer.close();
  return copied;
}

}  // namespace striper::wire
