// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace striper::detail {

/// A message as everybody gets it: made once, shared.
struct Payload {
  std::vector<std::uint8_t> bytes;
  std::uint64_t time_ns = 0;
};
using SharedPayload = std::shared_ptr<const Payload>;

/// What a client is still to be sent. Of each topic it holds the newest two messages, so that a
/// client that does not keep up is not behind, large topics do not elbow out small ones, and nobody
/// else waits. Texts are few and all kept, up to a bound.
class ClientOutbox {
 public:
  static constexpr std::size_t kMostOfTopic = 2;
  static constexpr std::size_t kMostTexts = 256;

  /// What is no message of a topic.
  struct Text {
    std::string bytes;
    bool is_binary = false;
  };
  struct Message {
    std::uint32_t subscription = 0;
    SharedPayload payload;
  };

  /// Replaces one that a client has of the channel.
  void subscribe(std::uint32_t channel, std::uint32_t subscription);
  void unsubscribe(std::uint32_t subscription);
  bool is_subscribed(std::uint32_t channel) const;

  /// @return whether an older message had to go.
  bool add(std::uint32_t channel, const SharedPayload& payload);
  /// @return false where there are too many: the client does not read.
  bool add_text(Text text);

  std::optional<Text> take_text();
  /// The topics in turn.
  std::optional<Message> take_message();

 private:
  struct Topic {
    std::uint32_t subscription = 0;
    std::deque<SharedPayload> waiting;
  };
  std::map<std::uint32_t, Topic> topics_;  // By channel.
  std::uint32_t last_taken_ = 0;
  std::deque<Text> texts_;
};

}  // namespace striper::detail
