// SPDX-License-Identifier: Apache-2.0
// Proves of the parts of the sink `web:`: addresses, whose requests are answered, what is said on a
// Foxglove WebSocket by the published layouts, and that a client's queue keeps the newest alone.
// What goes over the wire is in web_test.py.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>

#include "client_outbox.hpp"
#include "foxglove.hpp"
#include "page.hpp"
#include "parameter_json.hpp"
#include "rules/access.hpp"
#include "rules/http_rules.hpp"
#include "web_address.hpp"

namespace striper::detail {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

WebAddress parse(const char* text) { return WebAddress::parse(SinkUri::parse(text)); }

TEST(WebAddress, IsLoopbackUnlessAnAddressIsGiven) {
  EXPECT_EQ(parse("web:8765").address, "127.0.0.1");
  EXPECT_EQ(parse("web:8765").port, 8765);
  EXPECT_EQ(parse("web:0.0.0.0:80").address, "0.0.0.0");
  EXPECT_EQ(parse("web:[::1]:80").address, "::1");
  EXPECT_EQ(parse("web:localhost:80").address, "127.0.0.1");
  EXPECT_EQ(parse("web:0?frames=5").frames_hz, 5.0);
  EXPECT_EQ(parse("web:0?frames=5&images=raw").images, TopicImages::kRaw);
  EXPECT_EQ(parse("web:0?frames=5&images=both").images, TopicImages::kBoth);
  EXPECT_EQ(parse("web:0").images, TopicImages::kBoth);
  EXPECT_EQ(parse("web:0").frames_hz, 10.0);
  EXPECT_EQ(parse("web:0?frames=0").images, TopicImages::kNone);
}

TEST(WebAddress, RefusesWhatIsNone) {
  for (const char* text : {"web:", "web:port", "web:65536", "web:example.org:80", "web:1.2.3:80",
                           "web:80?frame=1", "web:80?images=png", "web:80?origin=example.org"}) {
    EXPECT_THROW(parse(text), Error) << text;
  }
}

TEST(HttpRules, AnswerOurOwnHostAlone) {
  const ServerName loopback{"127.0.0.1", 8765};
  for (const char* host : {"127.0.0.1:8765", "localhost:8765", "localhost", "[::1]:8765"})
    EXPECT_TRUE(is_our_host(host, loopback)) << host;
  for (const char* host : {"", "evil.example", "evil.example:8765", "127.0.0.1:80", "192.168.1.5",
                           "localhost.evil.example", "127.0.0.1.evil.example:8765", "[::1"})
    EXPECT_FALSE(is_our_host(host, loopback)) << host;
  const ServerName everywhere{"0.0.0.0", 8765};
  EXPECT_TRUE(is_our_host("192.168.1.5:8765", everywhere));
  EXPECT_FALSE(is_our_host("evil.example:8765", everywhere));
  EXPECT_FALSE(is_our_host("localhost:8765", {"192.168.1.5", 8765}));
}

TEST(HttpRules, AnswerOurOwnPagesAlone) {
  const std::vector<std::string> allowed = {"https://app.example"};
  EXPECT_TRUE(is_our_origin("", "127.0.0.1:8765", {}));
  EXPECT_TRUE(is_our_origin("http://127.0.0.1:8765", "127.0.0.1:8765", {}));
  EXPECT_TRUE(is_our_origin("https://app.example", "127.0.0.1:8765", allowed));
  for (const char* origin : {"http://evil.example", "null", "http://127.0.0.1:80",
                             "https://127.0.0.1:8765", "https://app.example.evil"})
    EXPECT_FALSE(is_our_origin(origin, "127.0.0.1:8765", allowed)) << origin;
}

TEST(HttpRules, TakeTargetsApart) {
  const Target target("/api/v1/events?a=1&since=17&b");
  EXPECT_EQ(target.path, "/api/v1/events");
  EXPECT_EQ(target.value("since"), "17");
  EXPECT_EQ(target.value("b"), "");
  EXPECT_EQ(target.value("c"), "");
  EXPECT_EQ(Target("/").value("since"), "");
}

TEST(HttpRules, DecodeNames) {
  EXPECT_EQ(decoded("a%2Fb%20c"), "a/b c");
  EXPECT_EQ(decoded("100%"), "100%");
  EXPECT_EQ(decoded("%g1%4"), "%g1%4");
}

TEST(Access, FindsTheSecretWhereverItIsShown) {
  EXPECT_EQ((ShownToken{"Bearer abc", "striper_token=x", "y"}).text(), "abc");
  EXPECT_EQ((ShownToken{"Basic abc", "a=b;  striper_token=x; c=d", "y"}).text(), "x");
  EXPECT_EQ((ShownToken{"", "xstriper_token=x", "y"}).text(), "y");
  EXPECT_EQ((ShownToken{"", ";;=;striper_token", ""}).text(), "");
}

TEST(Access, ComparesSecrets) {
  EXPECT_TRUE(is_same_secret("abc", "abc"));
  for (const char* other : {"", "ab", "abd", "abcabc", "abca"})
    EXPECT_FALSE(is_same_secret(other, "abc")) << other;
}

TEST(Access, LimitsRates) {
  using namespace std::chrono_literals;
  RateLimit::Clock::time_point now{1h};
  RateLimit limit(2.0, 3.0);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(limit.take(now));
  EXPECT_FALSE(limit.take(now));
  EXPECT_TRUE(limit.take(now += 500ms));
  EXPECT_FALSE(limit.take(now));
  AddressLimits wrong(1.0 / 6.0, 10.0);
  int taken = 0;
  for (int i = 0; i < 100; ++i) taken += wrong.take("192.168.1.5", now) ? 1 : 0;
  EXPECT_EQ(taken, 10);
  EXPECT_TRUE(wrong.take("192.168.1.6", now));
}

TEST(ParameterJson, IsTheSameBackwards) {
  for (const ParameterValue& value :
       {ParameterValue(), ParameterValue(true), ParameterValue(2.5), ParameterValue("red"),
        ParameterValue(std::vector<double>{1, 2})}) {
    EXPECT_EQ(parameter_of("a", to_json(value)).value, value);
  }
  EXPECT_THROW(parameter_of("a", json::object()), Error);
  EXPECT_THROW(parameter_of("a", json::parse(R"([1, "b"])")), Error);
  EXPECT_THROW(parse_json(std::string(100, '[') + std::string(100, ']')), Error);
}

TEST(Foxglove, SaysParametersAndServices) {
  const std::vector<Parameter> parameters = {{"/a/gain_db", 6.0}, {"/a/width", {}}};
  EXPECT_EQ(json::parse(foxglove::parameter_values(parameters, "7")),
            json::parse(R"({"op": "parameterValues", "id": "7", "parameters": [
                {"name": "/a/gain_db", "value": 6.0, "type": "float64"},
                {"name": "/a/width", "value": ""}]})"));
  const std::vector<foxglove::Service> services = {{3, "/a/stop", "{}"}};
  const json said = json::parse(foxglove::advertise(services));
  EXPECT_EQ(said["services"][0]["name"], "/a/stop");
  EXPECT_EQ(said["services"][0]["request"]["encoding"], "json");
  EXPECT_THAT(foxglove::service_response(1, 2, "{}"),
              ElementsAre(3, 1, 0, 0, 0, 2, 0, 0, 0, 4, 0, 0, 0, 'j', 's', 'o', 'n', '{', '}'));
}

TEST(Foxglove, ParametersAndCallsAreReadOrRefused) {
  const auto request = foxglove::parse_request(
      R"({"op": "setParameters", "id": "x", "parameters": [
          {"name": "a", "value": 5}, {"name": "b"}, {"name": "c", "value": ""}]})");
  ASSERT_EQ(request.parameters.size(), 3U);
  EXPECT_EQ(request.id, "x");
  EXPECT_EQ(request.parameters[0].value, ParameterValue(5.0));
  EXPECT_EQ(request.parameters[1].value, ParameterValue());
  EXPECT_EQ(request.parameters[2].value, ParameterValue());
  const std::string call("\2\1\0\0\0\2\0\0\0\4\0\0\0json{}", 19);
  EXPECT_EQ(foxglove::parse_call(call).call, 2U);
  EXPECT_EQ(foxglove::parse_call(call).payload, "{}");
  for (std::size_t size = 0; size < 17; ++size)
    EXPECT_THROW(foxglove::parse_call(std::string_view(call).substr(0, size)), Error) << size;
}

TEST(Foxglove, ChoosesTheFirstSubprotocolThatIsKnown) {
  using foxglove::choose_subprotocol;
  EXPECT_EQ(choose_subprotocol("foxglove.websocket.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(choose_subprotocol("foxglove.sdk.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(choose_subprotocol("x, foxglove.sdk.v1 ,foxglove.websocket.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(choose_subprotocol(""), "");
  EXPECT_EQ(choose_subprotocol(",,"), "");
  EXPECT_EQ(choose_subprotocol("foxglove.websocket.v2"), "");
}

TEST(Foxglove, HasTheLayoutsThatAreAgreed) {
  EXPECT_THAT(foxglove::message_header(0x04030201, 0x0c0b0a0908070605),
              ElementsAre(1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12));
  const std::vector<foxglove::Channel> channels = {
      {7, "/a/scan", "sensor_msgs/msg/LaserScan", "x"}};
  EXPECT_EQ(json::parse(foxglove::advertise(channels)), json::parse(R"({"op": "advertise",
      "channels": [{"id": 7, "topic": "/a/scan", "encoding": "cdr", "schemaEncoding": "ros2msg",
      "schemaName": "sensor_msgs/msg/LaserScan", "schema": "x"}]})"));
  EXPECT_EQ(json::parse(foxglove::status(foxglove::Level::kWarning, "slow\xff", "s"))["level"], 1);
  EXPECT_EQ(json::parse(foxglove::remove_status("s")),
            json::parse(R"({"op": "removeStatus", "statusIds": ["s"]})"));
  const json info = json::parse(foxglove::server_info("striper", "1"));
  for (const char* key :
       {"op", "name", "capabilities", "supportedEncodings", "metadata", "sessionId"})
    EXPECT_TRUE(info.contains(key)) << key;
}

TEST(Foxglove, RequestsAreReadOrRefused) {
  const auto request = foxglove::parse_request(
      R"({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 2}, {"id": 3, "channelId": 4}]})");
  ASSERT_EQ(request.subscriptions.size(), 2U);
  EXPECT_EQ(request.subscriptions[1].id, 3U);
  EXPECT_EQ(request.subscriptions[1].channel, 4U);
  EXPECT_THAT(
      foxglove::parse_request(R"({"op": "unsubscribe", "subscriptionIds": [5]})").unsubscribed_ids,
      ElementsAre(5));
  EXPECT_EQ(foxglove::parse_request(R"({"op": "fly"})").op, "fly");
  for (const char* text :
       {"", "x", "[]", "{}", "1", R"({"op": 1})", R"({"op": "subscribe"})",
        R"({"op": "subscribe", "subscriptions": 1})",
        R"({"op": "subscribe", "subscriptions": [1]})",
        R"({"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 2}]})",
        R"({"op": "subscribe", "subscriptions": [{"id": 4294967296, "channelId": 2}]})",
        R"({"op": "unsubscribe", "subscriptionIds": ["a"]})", R"({"op": "getParameters"})",
        R"({"op": "getParameters", "parameterNames": [1]})",
        R"({"op": "getParameters", "parameterNames": [], "id": 1})",
        R"({"op": "setParameters", "parameters": [{"value": 1}]})",
        R"({"op": "setParameters", "parameters": [{"name": "a", "value": {}}]})",
        R"({"op": [[[[[[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]]]]]})"}) {
    EXPECT_THROW(foxglove::parse_request(text), Error) << text;
  }
}

SharedPayload payload(std::uint64_t time_ns) {
  auto made = std::make_shared<Payload>();
  made->time_ns = time_ns;
  return made;
}

TEST(ClientOutbox, KeepsTheNewestTwoOfEachTopicInTurn) {
  ClientOutbox outbox;
  outbox.subscribe(1, 11);
  outbox.subscribe(2, 22);
  EXPECT_FALSE(outbox.add(3, payload(0)));  // Nobody asked for it.
  for (std::uint64_t t = 1; t <= 5; ++t) EXPECT_EQ(outbox.add(1, payload(t)), t > 2);
  EXPECT_FALSE(outbox.add(2, payload(9)));
  std::vector<std::pair<std::uint32_t, std::uint64_t>> taken;
  while (auto message = outbox.take_message())
    taken.emplace_back(message->subscription, message->payload->time_ns);
  EXPECT_THAT(taken, ElementsAre(std::pair(11U, 4ULL), std::pair(22U, 9ULL), std::pair(11U, 5ULL)));
  outbox.unsubscribe(11);
  EXPECT_FALSE(outbox.is_subscribed(1));
  EXPECT_TRUE(outbox.is_subscribed(2));
}

TEST(ClientOutbox, BoundsTexts) {
  ClientOutbox outbox;
  for (std::size_t i = 0; i < ClientOutbox::kMostTexts; ++i) EXPECT_TRUE(outbox.add_text({"a"}));
  EXPECT_FALSE(outbox.add_text({"b"}));
  EXPECT_EQ(outbox.take_text()->bytes, "a");
}

TEST(PageFiles, AreThoseOfThePageAndNoOthers) {
  ASSERT_NE(find_page_file("/"), nullptr);
  EXPECT_THAT(find_page_file("/")->type, HasSubstr("text/html"));
  ASSERT_NE(find_page_file("/live.js"), nullptr);
  EXPECT_THAT(find_page_file("/live.js")->type, HasSubstr("text/javascript"));
  for (const char* path : {"", "/..", "/../page.hpp", "/LIVE.JS", "live.js", "/etc/passwd"})
    EXPECT_EQ(find_page_file(path), nullptr) << path;
}

}  // namespace
}  // namespace striper::detail
