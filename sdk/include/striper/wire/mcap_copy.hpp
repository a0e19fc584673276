// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>
#include <vector>

#include <striper/wire/mcap_reader.hpp>
#include <striper/wire/mcap_writer.hpp>

namespace striper::wire {

/// What of an MCAP file is copied; what is not set lets everything through.
struct McapSelection {
  std::function<bool(const McapChannel&, McapMessage&)> message;  ///< May change its times.
  std::function<bool(std::string_view)> extra;  ///< An attachment or metadata, by its name.
  /// Asked after every message, with the bytes of the file that were read: false ends the copy,
  /// which is whole up to there.
  std::function<bool(std::uint64_t)> go_on;
};

/// What the copy has of the file.
struct McapCopied {
  std::uint64_t messages = 0;
  std::uint32_t attachments = 0;
  std::uint32_t metadata = 0;
  std::vector<McapDamage> damages;  ///< Of the file; left out of the copy.
  bool was_cut = false;             ///< It had no proper end.
  bool was_stopped = false;         ///< By `go_on`.
};

/// Copies what can be read of an MCAP file, and is selected, to a whole one. @throws Error: kUsage
/// where both are the same file, and as McapReader and McapWriter.
McapCopied copy_mcap(const std::filesystem::path& from, const std::filesystem::path& to,
                     const McapSelection& selection = {}, McapWriterOptions options = {});

}  // namespace striper::wire
