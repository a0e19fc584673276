// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <striper/wire/mcap_writer.hpp>

namespace striper::wire {

/// What a mended file has of the broken one.
struct McapMended {
  std::uint64_t messages = 0;
  std::uint32_t attachments = 0;
  std::uint32_t metadata = 0;
  std::uint64_t damaged_records = 0;  ///< Left out.
  std::string first_damage;           ///< Empty where there was none.
  bool was_cut = false;               ///< It had no proper end.
};

/// Copies what can be read of an MCAP file to a whole one. @throws Error: kUsage where both are the
/// same file, and as McapReader and McapWriter.
McapMended mend_mcap(const std::filesystem::path& broken, const std::filesystem::path& whole,
                     McapWriterOptions options = {});

}  // namespace striper::wire
