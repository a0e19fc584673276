// SPDX-License-Identifier: Apache-2.0
#include "client_outbox.hpp"

#include <utility>

namespace striper::detail {

void ClientOutbox::subscribe(std::uint32_t channel, std::uint32_t subscription) {
  topics_[channel] = {subscription, {}};
}

void ClientOutbox::unsubscribe(std::uint32_t subscription) {
  std::erase_if(topics_,
                [&](const auto& topic) { return topic.second.subscription == subscription; });
}

bool ClientOutbox::is_subscribed(std::uint32_t channel) const { return topics_.contains(channel); }

bool ClientOutbox::add(std::uint32_t channel, const SharedPayload& payload) {
  const auto topic = topics_.find(channel);
  if (topic == topics_.end()) return false;
  std::deque<SharedPayload>& waiting = topic->second.waiting;
  const bool is_full = waiting.size() == kMostOfTopic;
  if (is_full) waiting.pop_front();
  waiting.push_back(payload);
  return is_full;
}

bool ClientOutbox::add_text(Text text) {
  if (texts_.size() == kMostTexts) return false;
  texts_.push_back(std::move(text));
  return true;
}

std::optional<ClientOutbox::Text> ClientOutbox::take_text() {
  if (texts_.empty()) return std::nullopt;
  Text text = std::move(texts_.front());
  texts_.pop_front();
  return text;
}

std::optional<ClientOutbox::Message> ClientOutbox::take_message() {
  auto topic = topics_.upper_bound(last_taken_);
  for (std::size_t looked = 0; looked < topics_.size(); ++looked, ++topic) {
    if (topic == topics_.end()) topic = topics_.begin();
    std::deque<SharedPayload>& waiting = topic->second.waiting;
    if (waiting.empty()) continue;
    last_taken_ = topic->first;
    Message message{topic->second.subscription, std::move(waiting.front())};
    waiting.pop_front();
    return message;
  }
  return std::nullopt;
}

}  // namespace striper::detail
