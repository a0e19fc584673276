// SPDX-License-Identifier: Apache-2.0
// The one file that Boost.Beast is compiled in: it takes half a minute.
#include "web_server.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
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
constexpr std::uint32_t kMostHeader = 8192;
constexpr std::uint64_t kMostBody = 0;       // Nothing here takes one yet.
constexpr std::size_t kMostMessage = 65536;  // Of a client.
constexpr auto kRequestTime = 10s;           // To say a request, and to take its answer.
constexpr auto kIdleTime = 30s;              // Without an answer to a ping.
constexpr auto kKeepsUpAgain = 5s;           // Without a drop.
constexpr const char* kSlow = "slow";        // The status that says so.

using Request = http::request<http::string_body>;
using Response = http::response<http::string_body>;

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

void add_guards(Response& response) {
  response.set(http::field::server, "striper");
  response.set(http::field::cache_control, "no-store");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("X-Frame-Options", "DENY");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Content-Security-Policy",
               "default-src 'self'; connect-src 'self' ws: wss:; img-src 'self' blob: data:; "
               "frame-ancestors 'none'; base-uri 'none'; form-action 'none'");
}

Response refusal(const Request& request, http::status status, const std::string& why) {
  Response response(status, request.version());
  response.set(http::field::content_type, "text/plain; charset=utf-8");
  if (status == http::status::method_not_allowed) response.set(http::field::allow, "GET, HEAD");
  response.body() = why + "\n";
  response.keep_alive(false);
  return response;
}

}  // namespace

class WebServer::Impl {
 public:
  Impl(const WebAddress& address, Answerer answer)
      : address_(address), answer_(std::move(answer)), acceptor_(context_) {
    listen();
  }

  void start() {
    accept();
    thread_ = std::thread([this] { context_.run(); });
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
  std::vector<foxglove::Channel> offered() const;
  void count_reader(std::uint32_t channel, int change);
  SharedPayload latched(std::uint32_t channel) const;

  const WebAddress address_;
  const Answerer answer_;
  ServerName name_;
  std::atomic<std::uint64_t> clients_ = 0, sent_ = 0, dropped_ = 0, requests_ = 0, refused_ = 0;

  // Of the server's thread alone.
  std::size_t connections_ = 0;
  std::set<Client*> open_;
  bool is_stopping_ = false;

  mutable std::mutex mutex_;
  std::vector<Channel> channels_;  // By number, from 1 on.
  std::deque<Published> published_;
  bool is_handing_out_ = false;

  // Last: what is under way goes with the context, and looks at all of the above when it does.
  asio::io_context context_{1};
  tcp::acceptor acceptor_;
  std::thread thread_;
};

// A program that hears topics. Lives as long as something of it is under way.
class WebServer::Impl::Client : public std::enable_shared_from_this<Client> {
 public:
  Client(Impl& server, beast::tcp_stream&& stream) : server_(server), socket_(std::move(stream)) {}

  ~Client() {
    server_.open_.erase(this);
    for (const std::uint32_t channel : channels_) server_.count_reader(channel, -1);
    if (is_accepted_) --server_.clients_;
    --server_.connections_;
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

  void close() { beast::get_lowest_layer(socket_).close(); }

 private:
  void begin() {
    is_accepted_ = true;
    ++server_.clients_;
    server_.open_.insert(this);
    say(foxglove::server_info("striper", std::to_string(reinterpret_cast<std::uintptr_t>(this))));
    const auto channels = server_.offered();
    if (!channels.empty()) offer(channels);
    read_next();
  }

  void say(std::string text) {
    if (!outbox_.add_text(std::move(text))) return close();
    write_next();
  }

  void read_next() {
    socket_.async_read(in_, [self = shared_from_this()](error_code error, std::size_t) {
      if (!error) self->hear();
    });
  }

  void hear() {
    if (socket_.got_text()) {
      const auto data = in_.cdata();
      obey(std::string_view(static_cast<const char*>(data.data()), data.size()));
    }
    in_.consume(in_.size());
    read_next();
  }

  void obey(std::string_view text) {
    try {
      const foxglove::Request request = foxglove::parse_request(text);
      for (const foxglove::Subscription& one : request.subscriptions) subscribe(one);
      for (const std::uint32_t id : request.unsubscribed_ids) outbox_.unsubscribe(id);
      if (request.op != "subscribe" && request.op != "unsubscribe") {
        complain(fmt::format("'{}' is not known here", request.op));
      }
      recount();
    } catch (const Error& error) {
      complain(error.what());
    }
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
    outbox_.add_text(foxglove::remove_status(kSlow));
  }

  void write_next() {
    if (is_writing_ || !is_accepted_) return;
    note_pace();
    if (auto text = outbox_.take_text()) {
      out_text_ = std::move(*text);
      socket_.text(true);
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
  std::string out_text_;
  SharedPayload out_payload_;
  std::array<std::uint8_t, foxglove::kMessageHeader> header_{};
  std::chrono::steady_clock::time_point last_drop_;
  bool is_accepted_ = false;
  bool is_writing_ = false;
  bool is_slow_ = false;
};

// Somebody who asks, by HTTP.
class WebServer::Impl::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Impl& server, tcp::socket&& socket) : server_(server), stream_(std::move(socket)) {}

  ~Connection() {
    if (!is_handed_over_) --server_.connections_;
  }

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
      return send(refusal({}, http::status::payload_too_large, "a request has no body here"));
    }
    if (error == http::error::end_of_stream || error == asio::error::operation_aborted ||
        error == beast::error::timeout || error == asio::error::connection_reset) {
      return;
    }
    if (error) return send(refusal({}, http::status::bad_request, error.message()));
    const Request request = parser_->release();
    ++server_.requests_;
    if (const auto refused = check(request)) return send(*refused);
    if (websocket::is_upgrade(request)) return upgrade(request);
    answer(request);
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
    if (request.method() != http::verb::get && request.method() != http::verb::head) {
      return refusal(request, http::status::method_not_allowed, "GET and HEAD are answered");
    }
    return std::nullopt;
  }

  void upgrade(const Request& request) {
    const std::string_view offered = view(request[http::field::sec_websocket_protocol]);
    const std::string_view known = foxglove::choose_subprotocol(offered);
    if (Target(view(request.target())).path != "/" || known.empty()) {
      return send(refusal(request, http::status::bad_request,
                          "the WebSocket is at /, and speaks foxglove.websocket.v1 and "
                          "foxglove.sdk.v1"));
    }
    is_handed_over_ = true;
    stream_.expires_never();
    std::make_shared<Client>(server_, std::move(stream_))->accept(request, known);
  }

  void answer(const Request& request) {
    HttpAnswer made = server_.answer_(Target(view(request.target())));
    Response response(static_cast<http::status>(made.status), request.version());
    response.set(http::field::content_type, made.type);
    response.keep_alive(request.keep_alive());
    response.content_length(made.body.size());
    if (request.method() != http::verb::head) response.body() = std::move(made.body);
    send(std::move(response));
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
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{kMostHeader + 4096};
  std::optional<http::request_parser<http::string_body>> parser_;
  Response response_;
  bool is_handed_over_ = false;
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
  thread_.join();
}

WebServer::WebServer(const WebAddress& address, Answerer answer)
    : impl_(std::make_unique<Impl>(address, std::move(answer))) {
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
