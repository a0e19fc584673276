// SPDX-License-Identifier: Apache-2.0
#include <striper/pipeline/scanner_status.hpp>

namespace striper {

std::string_view to_string(SourceState state) noexcept {
  switch (state) {
    case SourceState::kStreaming:
      return "streaming";
    case SourceState::kSilent:
      return "silent";
    case SourceState::kPaused:
      return "paused";
    case SourceState::kEnded:
      return "ended";
    case SourceState::kWaiting:
      break;
  }
  return "waiting";
}

}  // namespace striper
