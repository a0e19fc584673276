// SPDX-License-Identifier: Apache-2.0
// Whatever somebody says to the sink web:, it is understood or refused with Error{kBadValue}, an
// answer of HTTP has a status and never says the secret, and nothing is changed without the secret
// but lasers switched off. The first byte says how it comes: a text or bytes of the WebSocket, a
// request of HTTP ("GET\n/target\nbody"), headers. Seeds: web_seeds.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include <striper/core/error.hpp>

#include "foxglove.hpp"
#include "head_watch.hpp"
#include "rules/access.hpp"
#include "rules/http_rules.hpp"
#include "scan_pieces.hpp"
#include "web_api.hpp"

namespace {

using namespace striper;
using namespace striper::detail;

constexpr std::string_view kSecret = "0123456789abcdef0123456789abcdef";

void require(bool is_so) {
  if (!is_so) std::abort();
}

// A program that takes every command, and knows whether it may.
class Program {
 public:
  Program() : api_(watch_, pieces_, [] { return WebCounts{}; }) {
    SinkServices services;
    services.heads = [] {
      ServedHead head;
      head.name = "a/b";
      head.source = "sim:x";
      return std::vector<ServedHead>{head};
    };
    services.sinks = [] { return std::vector<SinkReport>(); };
    services.recordings = [] { return std::vector<RecordingFile>{{"x.mcap", 1, 2.0}}; };
    services.parameters = [](std::string_view) {
      return std::vector<Parameter>{{"gain_db", 1.0}, {"width", {}}};
    };
    services.set_parameter = [this](std::string_view, const Parameter&) { require(may_change_); };
    services.command = [this](std::string_view, HeadCommand command, double) {
      require(may_change_ || command == HeadCommand::kLasersOff);
      return std::string("done");
    };
    services.why = [](std::string_view, int line) { return std::to_string(line); };
    services.token = [] { return std::string(kSecret); };
    api_.set_services(services);
  }

  void ask(std::string_view text, bool has_token) {
    may_change_ = has_token;
    const std::size_t first = text.find('\n');
    const std::size_t second = text.find('\n', first == text.npos ? first : first + 1);
    if (second == text.npos) return;
    const HttpAsk ask{std::string(text.substr(0, first)),
                      std::string(text.substr(first + 1, second - first - 1)),
                      std::string(text.substr(second + 1)), has_token};
    const HttpAnswer answer = api_.answer(ask);
    require(answer.status >= 200 && answer.status < 600);
    require(answer.body.find(kSecret) == std::string::npos);
    require(answer.cookie.empty() || ask.body.find(kSecret) != std::string::npos);
  }

  void call(std::string_view bytes, bool has_token) {
    may_change_ = has_token;
    const foxglove::Call call = foxglove::parse_call(bytes);
    api_.call(call.service, call.payload, has_token);
  }

 private:
  HeadWatch watch_;
  ScanPieces pieces_;
  WebApi api_;
  bool may_change_ = false;
};

void take_headers(std::string_view text) {
  const Target target(text);
  require(decoded(target.value("head")).size() <= text.size());
  const bool is_ours = is_our_host(text, {"127.0.0.1", 8765});
  require(!is_ours || text.find("127.") != text.npos || text.find("localhost") != text.npos ||
          text.find("::1") != text.npos);
  is_our_origin(text, text, {});
  require(ShownToken{text, text, text}.text().size() <= text.size());
  require(is_same_secret(text, kSecret) == (text == kSecret));
  foxglove::choose_subprotocol(text);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static Program program;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    switch (data[0] % 6) {
      case 0:
        foxglove::parse_request(text);
        break;
      case 1:
        program.call(text, false);
        break;
      case 2:
        program.call(text, true);
        break;
      case 3:
        program.ask(text, false);
        break;
      case 4:
        program.ask(text, true);
        break;
      default:
        take_headers(text);
    }
  } catch (const Error&) {  // What is wrong is said.
  }
  return 0;
}
