// SPDX-License-Identifier: Apache-2.0
// The one file that Boost.Beast is compiled in: it takes half a minute.
#include "web_server.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <fmt/format.h>

#include <striper/core/error.hpp>

#include "rules/access.hpp"

namespace striper::detail {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using namespace std::chrono_literals;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kMostConnections = 64;
constexpr std::size_t kMostClients = 100;  // WebSockets.
constexpr std::size_t kMostSlow = 32;      // Answers that wait for a camera.
constexpr std::uint32_t kMostHeader = 8192;
constexpr std::uint64_t kMostBody = 16384;
constexpr std::size_t kMostMessage = 65536;  // Of a client.
constexpr double kChangesPerSecond = 20.0;   // More than a hand on a slider makes.
constexpr double kChangesAtOnce = 40.0;
constexpr double kWrongTokensPerSecond = 1.0 / 6.0;
constexpr double kWrongTokensAtOnce = 10.0;
constexpr auto kRequestTime = 10s;     // To say a request, and to take its answer.
constexpr auto kIdleTime = 30s;        // Without an answer to a ping.
constexpr auto kKeepsUpAgain = 5s;     // Without a drop.
constexpr const char* kSlow = "slow";  // The status that says so.

constexpr std::string_view kLoginPath = "/api/v1/login";

using Request = http::request<http::string_body>;
using Response = http::response<http::string_body>;

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

void add_guards(http::response_header<>& response) {
  response.set(http::field::server, "striper");
  response.set(http::field::cache_control, "no-store");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("X-Frame-Options", "DENY");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Content-Security-Policy",
               "default-src 'self'; connect-src 'self' ws: wss:; img-src 'self' blob: data:; "
               "frame-ancestors 'none'; base-uri 'none'; form-action 'none'");
}

// @param why has nothing that JSON escapes.
Response refusal(const Request& request, http::status status, const std::string& why) {
  Response response(status, request.version());
  response.set(http::field::content_type, "application/json");
  if (status == http::status::unauthorized) response.set(http::field::www_authenticate, "Bearer");
  if (status == http::status::too_many_requests) response.set(http::field::retry_after, "6");
  response.body() = fmt::format("{{\"error\":\"{}\"}}\n", why);
  response.keep_alive(false);
  return response;
}

bool is_change(const Request& request) {
  return request.method() == http::verb::post || request.method() == http::verb::put;
}

// By which a client that comes back knows whether it is the same program.
std::string random_session() {
  std::random_device random;
  std::string text;
  for (int i = 0; i < 4; ++i) text += fmt::format("{:08x}", random());
  return text;
}

// "127.0.0.1"; empty where the other end is gone.
std::string address_of(const tcp::socket& socket) {
  error_code error;
  const tcp::endpoint other = socket.remote_endpoint(error);
  return error ? std::string() : other.address().to_string();
}

}  // namespace

class WebServer::Impl {
 public:
  Impl(const WebAddress& address, WebDesk& desk)
      : address_(address), desk_(desk), acceptor_(context_) {
    listen();
  }

  void start() {
    accept();
    thread_ = std::thread([this] { context_.run(); });
    for (Aside* const aside : {&slow_, &urgent_}) {
      aside->thread = std::thread([aside] {
        const auto stays = asio::make_work_guard(aside->context);
        aside->context.run();
      });
    }
  }

  void stop() noexcept;

  const ServerName& name() const noexcept { return name_; }

  std::uint32_t add_channel(const std::string& topic, const std::string& schema_name,
                            const std::string& schema, bool is_latched);
  bool is_wanted(std::uint32_t channel) const;
  void publish(std::uint32_t channel, SharedPayload payload);

  WebCounts counts() const {
    return {clients_.load(), sent_.load(), dropped_.load(), requests_.load(), refused_.load()};
  }

 private:
  class Connection;
  class Client;

  struct Channel {
    foxglove::Channel about;
    bool is_latched = false;
    int readers = 0;
    SharedPayload last;  // Of a latched one.
  };
  struct Published {
    std::uint32_t channel;
    SharedPayload payload;
  };

  void listen();
  void accept();
  void hand_out();
  // What is done on the thread of slow answers, and gives what is then done on the server's.
  using Then = std::function<void()>;
  // A thread of slow answers, and how many wait for it.
  struct Aside {
    asio::io_context context{1};
    std::thread thread;
    std::size_t waiting = 0;  // Of the server's thread.
  };
  bool do_slowly(std::function<Then()> work) { return do_aside(slow_, std::move(work)); }
  bool is_free_to_all(const Request& request) const {
    return desk_.is_free_to_all(HttpAsk{std::string(view(request.method_string())),
                                        std::string(view(request.target())),
                                        {},
                                        false});
  }
  bool do_aside(Aside& aside, std::function<Then()> work);
  void tell_parameters();
  enum class Shown { kNothing, kRight, kWrong, kTooOften };
  Shown look_at_token(const Request& request, const std::string& address);
  std::vector<foxglove::Channel> offered() const;
  void count_reader(std::uint32_t channel, int change);
  SharedPayload latched(std::uint32_t channel) const;

  const WebAddress address_;
  WebDesk& desk_;
  const std::string session_ = random_session();
  ServerName name_;
  std::atomic<std::uint64_t> clients_ = 0, sent_ = 0, dropped_ = 0, requests_ = 0, refused_ = 0;

  // Of the server's thread alone.
  std::size_t connections_ = 0;
  std::size_t sockets_ = 0;
  std::set<Client*> open_;
  AddressLimits changes_{kChangesPerSecond, kChangesAtOnce};
  AddressLimits wrong_tokens_{kWrongTokensPerSecond, kWrongTokensAtOnce};
  bool is_stopping_ = false;

  mutable std::mutex mutex_;
  std::vector<Channel> channels_;  // By number, from 1 on.
  std::deque<Published> published_;
  bool is_handing_out_ = false;

  // Last: what is under way goes with the context, and looks at all of the above when it does.
  asio::io_context context_{1};
  tcp::acceptor acceptor_;
  Aside slow_;
  Aside urgent_;  // What is free to all: lasers off.
  std::thread thread_;
};

// A program that hears topics. Lives as long as something of it is under way.
class WebServer::Impl::Client : public std::enable_shared_from_this<Client> {
 public:
  Client(Impl& server, beast::tcp_stream&& stream, bool has_token)
      : server_(server), socket_(std::move(stream)), has_token_(has_token) {
    ++server_.sockets_;
  }

  ~Client() {
    server_.open_.erase(this);
    for (const std::uint32_t channel : channels_) server_.count_reader(channel, -1);
    if (is_accepted_) --server_.clients_;
    --server_.sockets_;
  }

  void accept(const Request& request, std::string_view subprotocol) {
    auto limits = websocket::stream_base::timeout::suggested(beast::role_type::server);
    limits.handshake_timeout = kRequestTime;
    limits.idle_timeout = kIdleTime;
    limits.keep_alive_pings = true;
    socket_.set_option(limits);
    socket_.set_option(websocket::stream_base::decorator(
        [name = std::string(subprotocol)](websocket::response_type& response) {
          response.set(http::field::server, "striper");
          response.set(http::field::sec_websocket_protocol, name);
        }));
    socket_.read_message_max(kMostMessage);
    socket_.auto_fragment(false);
    socket_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (!error) self->begin();
    });
  }

  void offer(const std::vector<foxglove::Channel>& channels) { say(foxglove::advertise(channels)); }

  void give(std::uint32_t channel, const SharedPayload& payload) {
    if (!outbox_.is_subscribed(channel)) return;
    if (outbox_.add(channel, payload)) note_drop();
    write_next();
  }

  const std::set<std::string>& watched() const noexcept { return watched_; }
  // Of all of these, what the client wants to hear of.
  void tell(const std::vector<Parameter>& parameters) {
    std::vector<Parameter> wanted;
    for (const Parameter& one : parameters) {
      if (watched_.contains(one.name)) wanted.push_back(one);
    }
    if (!wanted.empty()) say(foxglove::parameter_values(wanted, {}));
  }

  void close() { beast::get_lowest_layer(socket_).close(); }

 private:
  void begin() {
    is_accepted_ = true;
    ++server_.clients_;
    server_.open_.insert(this);
    say(foxglove::server_info("striper", server_.session_));
    const auto channels = server_.offered();
    if (!channels.empty()) offer(channels);
    const auto services = server_.desk_.services();
    if (!services.empty()) say(foxglove::advertise(services));
    read_next();
  }

  void say(std::string text) { say(ClientOutbox::Text{std::move(text)}); }
  void say(ClientOutbox::Text text) {
    if (!outbox_.add_text(std::move(text))) return close();
    write_next();
  }

  void read_next() {
    socket_.async_read(in_, [self = shared_from_this()](error_code error, std::size_t) {
      if (!error) self->hear();
    });
  }

  void hear() {
    const auto data = in_.cdata();
    const std::string_view said(static_cast<const char*>(data.data()), data.size());
    try {
      socket_.got_text() ? obey(said) : call(said);
    } catch (const Error& error) {
      complain(error.what());
    }
    in_.consume(in_.size());
    read_next();
  }

  void obey(std::string_view text) {
    foxglove::Request request = foxglove::parse_request(text);
    if (request.op == "getParameters") return give_parameters(request.parameter_names, request.id);
    if (request.op == "setParameters") return set_parameters(std::move(request));
    if (request.op == "subscribeParameterUpdates") return watch(request.parameter_names);
    if (request.op == "unsubscribeParameterUpdates") {
      for (const std::string& name : request.parameter_names) watched_.erase(name);
      return;
    }
    if (request.op != "subscribe" && request.op != "unsubscribe") {
      return complain(fmt::format("'{}' is not known here", request.op));
    }
    for (const foxglove::Subscription& one : request.subscriptions) subscribe(one);
    for (const std::uint32_t id : request.unsubscribed_ids) outbox_.unsubscribe(id);
    recount();
  }

  // Does it where there is room for it; what it throws becomes a status.
  void do_slowly(std::function<Then()> work) { do_aside(server_.slow_, std::move(work)); }
  void do_aside(Aside& aside, std::function<Then()> work) {
    const bool is_taken =
        server_.do_aside(aside, [self = shared_from_this(), work = std::move(work)]() -> Then {
          try {
            return work();
          } catch (const std::exception& error) {
            return [self, why = std::string(error.what())] { self->complain(why); };
          }
        });
    if (!is_taken) complain("too much waits for the camera");
  }

  void give_parameters(std::vector<std::string> names, std::string id) {
    do_slowly([this, names = std::move(names), id = std::move(id)]() -> Then {
      std::string text = foxglove::parameter_values(server_.desk_.parameters(names), id);
      return [this, text = std::move(text)] { say(text); };
    });
  }

  void watch(const std::vector<std::string>& names) {
    constexpr std::size_t kMost = 1000;
    watched_.insert(names.begin(), names.end());
    if (watched_.size() > kMost) watched_.clear();
    give_parameters(names, {});
  }

  bool may_change() {
    if (!has_token_) {
      complain(
          fmt::format("changing something needs the secret: connect to ws://HOST:{}/?token=...",
                      server_.name_.port));
    } else if (!changes_.take(RateLimit::Clock::now())) {
      complain("that are too many changes in a second");
    } else {
      return true;
    }
    return false;
  }

  void set_parameters(foxglove::Request request) {
    if (!may_change()) return;
    do_slowly([this, request = std::move(request)]() -> Then {
      std::vector<std::string> names;
      std::string refused;
      for (const Parameter& one : request.parameters) {
        names.push_back(one.name);
        try {
          server_.desk_.set_parameter(one);
        } catch (const Error& error) {
          refused += std::string(refused.empty() ? "" : "; ") + error.what();
        }
      }
      std::string text = foxglove::parameter_values(server_.desk_.parameters(names), request.id);
      return [this, text = std::move(text), refused, has_id = !request.id.empty()] {
        if (!refused.empty()) complain(refused);
        if (has_id) say(text);
        server_.tell_parameters();
      };
    });
  }

  void call(std::string_view bytes) {
    const foxglove::Call call = foxglove::parse_call(bytes);
    const bool is_free = server_.desk_.is_free_to_all(call.service);
    if (!is_free && !changes_.take(RateLimit::Clock::now())) {
      return say(foxglove::service_failure(call.service, call.call, "too many calls in a second"));
    }
    Aside& aside = is_free ? server_.urgent_ : server_.slow_;
    do_aside(aside,
             [this, service = call.service, number = call.call,
              request = std::string(call.payload)]() -> Then {
               try {
                 const std::string made = server_.desk_.call(service, request, has_token_);
                 const auto answer = foxglove::service_response(service, number, made);
                 return [this, text = std::string(answer.begin(), answer.end())] {
                   say(ClientOutbox::Text{text, true});
                   server_.tell_parameters();
                 };
               } catch (const Error& error) {
                 return [this, text = foxglove::service_failure(service, number, error.what())] {
                   say(text);
                 };
               }
             });
  }

  void complain(const std::string& what) {
    say(foxglove::status(foxglove::Level::kWarning, what, "request"));
  }

  void subscribe(const foxglove::Subscription& wanted) {
    const auto channels = server_.offered();
    if (wanted.channel == 0 || wanted.channel > channels.size()) {
      return complain(fmt::format("there is no channel {}", wanted.channel));
    }
    outbox_.subscribe(wanted.channel, wanted.id);
    if (const SharedPayload last = server_.latched(wanted.channel)) give(wanted.channel, last);
  }

  void recount() {
    std::set<std::uint32_t> now;
    const auto channels = server_.offered();
    for (const auto& channel : channels) {
      if (outbox_.is_subscribed(channel.id)) now.insert(channel.id);
    }
    for (const std::uint32_t channel : channels_) server_.count_reader(channel, -1);
    for (const std::uint32_t channel : now) server_.count_reader(channel, 1);
    channels_ = std::move(now);
  }

  void note_drop() {
    ++server_.dropped_;
    last_drop_ = std::chrono::steady_clock::now();
    if (std::exchange(is_slow_, true)) return;
    say(foxglove::status(foxglove::Level::kWarning,
                         "this connection does not keep up: scans are left out for it", kSlow));
  }

  void note_pace() {
    if (!is_slow_ || std::chrono::steady_clock::now() - last_drop_ < kKeepsUpAgain) return;
    is_slow_ = false;
    outbox_.add_text({foxglove::remove_status(kSlow)});
  }

  void write_next() {
    if (is_writing_ || !is_accepted_) return;
    note_pace();
    if (auto text = outbox_.take_text()) {
      out_text_ = std::move(text->bytes);
      socket_.text(!text->is_binary);
      return write(asio::const_buffer(out_text_.data(), out_text_.size()));
    }
    auto message = outbox_.take_message();
    if (!message) return;
    out_payload_ = std::move(message->payload);
    header_ = foxglove::message_header(message->subscription, out_payload_->time_ns);
    socket_.binary(true);
    ++server_.sent_;
    write(std::array<asio::const_buffer, 2>{
        asio::const_buffer(header_.data(), header_.size()),
        asio::const_buffer(out_payload_->bytes.data(), out_payload_->bytes.size())});
  }

  template <typename Buffers>
  void write(const Buffers& buffers) {
    is_writing_ = true;
    socket_.async_write(buffers, [self = shared_from_this()](error_code error, std::size_t) {
      self->is_writing_ = false;
      if (!error) self->write_next();
    });
  }

  Impl& server_;
  websocket::stream<beast::tcp_stream> socket_;
  beast::flat_buffer in_;
  ClientOutbox outbox_;
  std::set<std::uint32_t> channels_;
  std::set<std::string> watched_;  // Parameters.
  std::string out_text_;
  SharedPayload out_payload_;
  std::array<std::uint8_t, foxglove::kMessageHeader> header_{};
  std::chrono::steady_clock::time_point last_drop_;
  const bool has_token_;
  RateLimit changes_{kChangesPerSecond, kChangesAtOnce};
  bool is_accepted_ = false;
  bool is_writing_ = false;
  bool is_slow_ = false;
};

// Somebody who asks, by HTTP.
class WebServer::Impl::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Impl& server, tcp::socket&& socket)
      : server_(server), address_(address_of(socket)), stream_(std::move(socket)) {}

  ~Connection() { --server_.connections_; }

  void read_next() {
    parser_.emplace();
    parser_->header_limit(kMostHeader);
    parser_->body_limit(kMostBody);
    stream_.expires_after(kRequestTime);
    http::async_read(
        stream_, buffer_, *parser_,
        [self = shared_from_this()](error_code error, std::size_t) { self->hear(error); });
  }

 private:
  void hear(error_code error) {
    if (error == http::error::header_limit) {
      return send(refusal({}, http::status::request_header_fields_too_large, "8 kB of header"));
    }
    if (error == http::error::body_limit) {
      return send(refusal({}, http::status::payload_too_large, "16 kB of body"));
    }
    if (error == http::error::end_of_stream || error == asio::error::operation_aborted ||
        error == beast::error::timeout || error == asio::error::connection_reset) {
      return;
    }
    if (error) return send(refusal({}, http::status::bad_request, "this is no request of HTTP"));
    const Request request = parser_->release();
    ++server_.requests_;
    if (const auto refused = check(request)) return send(*refused);
    const Shown shown = server_.look_at_token(request, address_);
    if (const auto refused = check(request, shown)) return send(*refused);
    if (websocket::is_upgrade(request)) return upgrade(request, shown == Shown::kRight);
    answer(request, shown == Shown::kRight);
  }

  std::optional<Response> check(const Request& request) const {
    const std::string_view host = view(request[http::field::host]);
    if (!is_our_host(host, server_.name_)) {
      return refusal(request, http::status::forbidden,
                     "Host is not this server's address: open it by its address");
    }
    const std::string_view origin = view(request[http::field::origin]);
    if (!is_our_origin(origin, host, server_.address_.origins)) {
      return refusal(request, http::status::forbidden,
                     "Origin is not this server's: allow it by web:...?origin=");
    }
    const http::verb method = request.method();
    if (method != http::verb::get && method != http::verb::head && !is_change(request)) {
      Response response = refusal(request, http::status::method_not_allowed,
                                  "GET, HEAD, POST and PUT are answered");
      response.set(http::field::allow, "GET, HEAD, POST, PUT");
      return response;
    }
    return std::nullopt;
  }

  std::optional<Response> check(const Request& request, Shown shown) const {
    if (shown == Shown::kWrong) {
      return refusal(request, http::status::unauthorized, "this is not the secret");
    }
    if (shown == Shown::kTooOften) {
      return refusal(request, http::status::too_many_requests,
                     "that was the wrong secret too often: wait");
    }
    const bool is_counted = is_change(request) && !server_.is_free_to_all(request);
    if (is_counted && !server_.changes_.take(address_, RateLimit::Clock::now())) {
      return refusal(request, http::status::too_many_requests,
                     "that are too many changes in a second");
    }
    return std::nullopt;
  }

  void upgrade(const Request& request, bool has_token) {
    const std::string_view offered = view(request[http::field::sec_websocket_protocol]);
    const std::string_view known = foxglove::choose_subprotocol(offered);
    if (Target(view(request.target())).path != "/" || known.empty()) {
      return send(refusal(request, http::status::bad_request,
                          "the WebSocket is at /, and speaks foxglove.websocket.v1 and "
                          "foxglove.sdk.v1"));
    }
    if (server_.sockets_ >= kMostClients) {
      return send(refusal(request, http::status::service_unavailable,
                          fmt::format("{} clients are here already", kMostClients)));
    }
    stream_.expires_never();
    std::make_shared<Client>(server_, std::move(stream_), has_token)->accept(request, known);
  }

  void answer(const Request& request, bool has_token) {
    HttpAsk ask{std::string(view(request.method_string())), std::string(view(request.target())),
                request.body(), has_token};
    const bool is_head = request.method() == http::verb::head;
    const auto give = [self = shared_from_this(), version = request.version(), is_head,
                       is_change = is_change(request),
                       is_kept = request.keep_alive()](HttpAnswer&& made) {
      if (!made.file.empty()) return self->send_file(made, version, is_head, is_kept);
      self->send(response_of(std::move(made), version, is_head, is_kept));
      if (is_change) self->server_.tell_parameters();
    };
    if (!server_.desk_.is_slow(ask)) return give(server_.desk_.answer(ask));
    Aside& aside = server_.desk_.is_free_to_all(ask) ? server_.urgent_ : server_.slow_;
    const bool is_taken = server_.do_aside(aside, [this, give, ask = std::move(ask)]() -> Then {
      auto made = std::make_shared<HttpAnswer>(server_.desk_.answer(ask));
      return [give, made] { give(std::move(*made)); };
    });
    if (!is_taken) {
      send(refusal(request, http::status::too_many_requests, "too much waits for the camera"));
    }
  }

  static Response response_of(HttpAnswer&& made, unsigned version, bool is_head, bool is_kept) {
    Response response(static_cast<http::status>(made.status), version);
    response.set(http::field::content_type, made.type);
    if (!made.allow.empty()) response.set(http::field::allow, made.allow);
    if (!made.cookie.empty()) response.set(http::field::set_cookie, made.cookie);
    if (made.status == 401) response.set(http::field::www_authenticate, "Bearer");
    response.keep_alive(is_kept);
    response.content_length(made.body.size());
    if (!is_head) response.body() = std::move(made.body);
    return response;
  }

  // A recording may be large: it is read as it is sent, and each piece has its time.
  void send_file(const HttpAnswer& made, unsigned version, bool is_head, bool is_kept) {
    error_code error;
    http::file_body::value_type body;
    body.open(made.file.c_str(), beast::file_mode::scan, error);
    if (error) return send(refusal({}, http::status::not_found, "this file is gone"));
    const std::uint64_t size = body.size();
    if (is_head) body = {};
    file_.emplace(std::piecewise_construct, std::make_tuple(std::move(body)),
                  std::make_tuple(http::status::ok, version));
    file_->set(http::field::content_type, made.type);
    file_->set(http::field::content_disposition, "attachment");
    add_guards(*file_);
    file_->keep_alive(is_kept);
    file_->content_length(size);
    serializer_.emplace(*file_);
    serializer_->split(is_head);
    is_head ? send_header() : send_piece();
  }

  void send_header() {
    stream_.expires_after(kRequestTime);
    http::async_write_header(
        stream_, *serializer_,
        [self = shared_from_this()](error_code error, std::size_t) { self->conclude_file(error); });
  }

  void send_piece() {
    stream_.expires_after(kRequestTime);
    http::async_write_some(stream_, *serializer_,
                           [self = shared_from_this()](error_code error, std::size_t) {
                             if (error || self->serializer_->is_done())
                               return self->conclude_file(error);
                             self->send_piece();
                           });
  }

  void conclude_file(error_code error) {
    const bool is_kept = !error && file_->keep_alive();
    serializer_.reset();
    file_.reset();
    if (is_kept) return read_next();
    stream_.socket().shutdown(tcp::socket::shutdown_send, error);
  }

  void send(Response response) {
    if (response.result_int() >= 400) ++server_.refused_;
    add_guards(response);
    if (!response.has_content_length()) response.prepare_payload();
    response_ = std::move(response);
    stream_.expires_after(kRequestTime);
    http::async_write(stream_, response_,
                      [self = shared_from_this()](error_code error, std::size_t) {
                        if (error) return;
                        if (self->response_.keep_alive()) return self->read_next();
                        error_code ignored;
                        self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
                      });
  }

  Impl& server_;
  const std::string address_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{kMostHeader + kMostBody};
  std::optional<http::request_parser<http::string_body>> parser_;
  Response response_;
  std::optional<http::response<http::file_body>> file_;
  std::optional<http::response_serializer<http::file_body>> serializer_;
};

void WebServer::Impl::listen() {
  error_code error;
  const auto address = asio::ip::make_address(address_.address, error);
  const tcp::endpoint wanted(address, address_.port);
  if (!error) acceptor_.open(wanted.protocol(), error);
  if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor_.bind(wanted, error);
  if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
  if (error) {
    throw Error(ErrorKind::kIo, fmt::format("web: nothing can listen at {} port {}: {}",
                                            address_.address, address_.port, error.message()));
  }
  name_ = {address_.address, acceptor_.local_endpoint().port()};
}

void WebServer::Impl::accept() {
  acceptor_.async_accept([this](error_code error, tcp::socket socket) {
    if (is_stopping_ || error == asio::error::operation_aborted) return;
    if (!error && connections_ < kMostConnections) {
      error_code ignored;
      socket.set_option(tcp::no_delay(true), ignored);
      ++connections_;
      std::make_shared<Connection>(*this, std::move(socket))->read_next();
    }
    accept();
  });
}

bool WebServer::Impl::do_aside(Aside& aside, std::function<Then()> work) {
  if (aside.waiting >= kMostSlow) return false;
  ++aside.waiting;
  asio::post(aside.context, [this, &aside, work = std::move(work)]() mutable {
    Then then = work();
    // The work goes to the server's thread, too: what it holds may be the last of a connection.
    asio::post(context_, [&aside, then = std::move(then), work = std::move(work)] {
      --aside.waiting;
      then();
    });
  });
  return true;
}

// What clients watch, after something was changed by whomever.
void WebServer::Impl::tell_parameters() {
  std::set<std::string> watched;
  for (const Client* const client : open_) {
    watched.insert(client->watched().begin(), client->watched().end());
  }
  if (watched.empty()) return;
  do_slowly([this, names = std::vector<std::string>(watched.begin(), watched.end())]() -> Then {
    std::vector<Parameter> now;
    try {
      now = desk_.parameters(names);
    } catch (const Error&) {
      return [] {};  // Its camera is gone, which events tell.
    }
    return [this, now = std::move(now)] {
      for (Client* const client : open_) client->tell(now);
    };
  });
}

// An old secret in a browser's cookie is as none where nothing is changed, and any wrong one where
// lasers are to go off.
WebServer::Impl::Shown WebServer::Impl::look_at_token(const Request& request,
                                                      const std::string& address) {
  const Target target(view(request.target()));
  const bool is_upgrade = websocket::is_upgrade(request);
  ShownToken shown{view(request[http::field::authorization]), view(request[http::field::cookie]),
                   is_upgrade ? target.value("token") : std::string_view()};
  const bool is_login = target.path == kLoginPath && is_change(request);
  if (is_login)
    return wrong_tokens_.take(address, RateLimit::Clock::now()) ? Shown::kNothing
                                                                : Shown::kTooOften;
  if (shown.text().empty()) return Shown::kNothing;
  const std::string token = desk_.token();
  if (!token.empty() && is_same_secret(shown.text(), token)) return Shown::kRight;
  if (is_free_to_all(request)) return Shown::kNothing;
  const bool is_cookie = shown.authorization.empty() && shown.query.empty();
  if (is_cookie && !is_change(request)) return Shown::kNothing;
  if (!wrong_tokens_.take(address, RateLimit::Clock::now())) return Shown::kTooOften;
  desk_.note_refusal(address);
  return Shown::kWrong;
}

std::uint32_t WebServer::Impl::add_channel(const std::string& topic, const std::string& schema_name,
                                           const std::string& schema, bool is_latched) {
  Channel channel;
  {
    const std::lock_guard lock(mutex_);
    channel.about = {static_cast<std::uint32_t>(channels_.size() + 1), topic, schema_name, schema};
    channel.is_latched = is_latched;
    channels_.push_back(channel);
  }
  asio::post(context_, [this, about = channel.about] {
    for (Client* const client : open_) client->offer({about});
  });
  return channel.about.id;
}

bool WebServer::Impl::is_wanted(std::uint32_t channel) const {
  const std::lock_guard lock(mutex_);
  const Channel& one = channels_[channel - 1];
  return one.is_latched || one.readers > 0;
}

void WebServer::Impl::publish(std::uint32_t channel, SharedPayload payload) {
  const std::lock_guard lock(mutex_);
  Channel& one = channels_[channel - 1];
  if (one.is_latched) one.last = payload;
  // What the server's thread did not come to hand out is replaced, as a slow client's is.
  const auto same = [&](const Published& other) { return other.channel == channel; };
  const auto waiting = std::count_if(published_.begin(), published_.end(), same);
  if (waiting >= static_cast<std::ptrdiff_t>(ClientOutbox::kMostOfTopic)) {
    published_.erase(std::find_if(published_.begin(), published_.end(), same));
    ++dropped_;
  }
  published_.push_back({channel, std::move(payload)});
  if (std::exchange(is_handing_out_, true)) return;
  asio::post(context_, [this] { hand_out(); });
}

void WebServer::Impl::hand_out() {
  std::deque<Published> now;
  {
    const std::lock_guard lock(mutex_);
    now.swap(published_);
    is_handing_out_ = false;
  }
  for (const Published& one : now) {
    // A client that is closed here goes when what it has under way has ended.
    for (Client* const client : open_) client->give(one.channel, one.payload);
  }
}

std::vector<foxglove::Channel> WebServer::Impl::offered() const {
  const std::lock_guard lock(mutex_);
  std::vector<foxglove::Channel> all;
  for (const Channel& channel : channels_) all.push_back(channel.about);
  return all;
}

void WebServer::Impl::count_reader(std::uint32_t channel, int change) {
  const std::lock_guard lock(mutex_);
  channels_[channel - 1].readers += change;
}

SharedPayload WebServer::Impl::latched(std::uint32_t channel) const {
  const std::lock_guard lock(mutex_);
  return channels_[channel - 1].last;
}

void WebServer::Impl::stop() noexcept {
  if (!thread_.joinable()) return;
  asio::post(context_, [this] {
    is_stopping_ = true;
    error_code ignored;
    acceptor_.close(ignored);
    context_.stop();
  });
  for (Aside* const aside : {&slow_, &urgent_}) {
    aside->context.stop();
    aside->thread.join();
  }
  thread_.join();
}

WebServer::WebServer(const WebAddress& address, WebDesk& desk)
    : impl_(std::make_unique<Impl>(address, desk)) {
  impl_->start();
}

WebServer::~WebServer() { stop(); }

const ServerName& WebServer::name() const noexcept { return impl_->name(); }

std::string WebServer::url() const {
  const ServerName& name = impl_->name();
  const bool is_ipv6 = name.address.find(':') != std::string::npos;
  return is_ipv6 ? fmt::format("http://[{}]:{}/", name.address, name.port)
                 : fmt::format("http://{}:{}/", name.address, name.port);
}

std::uint32_t WebServer::add_channel(const std::string& topic, const std::string& schema_name,
                                     const std::string& schema, bool is_latched) {
  return impl_->add_channel(topic, schema_name, schema, is_latched);
}

bool WebServer::is_wanted(std::uint32_t channel) const { return impl_->is_wanted(channel); }

void WebServer::publish(std::uint32_t channel, SharedPayload payload) {
  impl_->publish(channel, std::move(payload));
}

WebCounts WebServer::counts() const { return impl_->counts(); }

void WebServer::stop() noexcept { impl_->stop(); }

}  // namespace striper::detail
