// SPDX-License-Identifier: Apache-2.0
#include "web_api.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>
#include <striper/model/model_yaml.hpp>

#include "page.hpp"
#include "parameter_json.hpp"
#include "rules/access.hpp"
#include "rules/http_rules.hpp"

namespace striper::detail {
namespace {

using nlohmann::json;

constexpr std::string_view kHeads = "/api/v1/heads/";
constexpr std::string_view kWhy = "/api/v1/why";
constexpr std::string_view kRecordings = "/api/v1/recordings/";
constexpr std::string_view kStopPlaying = "/api/v1/playback/stop";
constexpr const char* kText = "text/plain; charset=utf-8";

/// A command, as it stands in addresses and services.
struct CommandWord {
  std::string_view word;
  HeadCommand command;
  bool needs_token;
  const char* request_schema;
};

constexpr const char* kNothing = R"({"type":"object","properties":{}})";
constexpr CommandWord kCommands[] = {
    {"start", HeadCommand::kStart, true, kNothing},
    {"stop", HeadCommand::kStop, true, kNothing},
    {"lasers_off", HeadCommand::kLasersOff, false, kNothing},
    {"lasers_on", HeadCommand::kLasersOn, true, kNothing},
    {"record", HeadCommand::kRecord, true,
     R"({"type":"object","properties":{"seconds":{"type":"number"}}})"},
};

const CommandWord* find_command(std::string_view word) {
  const auto* const found = std::find_if(std::begin(kCommands), std::end(kCommands),
                                         [&](const CommandWord& one) { return one.word == word; });
  return found == std::end(kCommands) ? nullptr : found;
}

// Services are numbered from 1 on, the commands of the first head first; null where there is none.
constexpr std::size_t kOfHead = std::size(kCommands);
const CommandWord* command_of_service(std::uint32_t service, std::size_t heads) {
  const bool is_there = service > 0 && service <= heads * kOfHead;
  return is_there ? &kCommands[(service - 1) % kOfHead] : nullptr;
}

std::uint64_t number(std::string_view text) {
  std::uint64_t value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

HttpAnswer failure(unsigned status, std::string_view why) {
  HttpAnswer answer;
  answer.status = status;
  answer.body = dump_json({{"error", why}}) + "\n";
  return answer;
}

HttpAnswer needs_token() {
  return failure(401, "changing something needs the secret: Authorization: Bearer T, or log in");
}

HttpAnswer not_allowed(const char* methods) {
  HttpAnswer answer = failure(405, fmt::format("{} are answered here", methods));
  answer.allow = methods;
  return answer;
}

unsigned status_of(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::kNotFound:
      return 404;
    case ErrorKind::kUsage:
    case ErrorKind::kBadValue:
      return 400;
    case ErrorKind::kUnsupported:
      return 403;
    case ErrorKind::kDevice:
      return 503;
    default:
      return 500;
  }
}

HttpAnswer done(const json& body) {
  HttpAnswer answer;
  answer.body = dump_json(body) + "\n";
  return answer;
}

std::string slashed(std::string_view head, std::string_view name) {
  return fmt::format("/{}/{}", head, name);
}

// An empty body is an empty object.
json object_of(const HttpAsk& ask) {
  json made = ask.body.empty() ? json::object() : parse_json(ask.body);
  if (!made.is_object()) throw Error(ErrorKind::kBadValue, "an object of JSON is expected");
  return made;
}

double seconds_of(const json& request) {
  const auto found = request.find("seconds");
  const bool is_there = found != request.end() && found->is_number();
  if (is_there) return found->get<double>();
  throw Error(ErrorKind::kBadValue, R"(how long is said as {"seconds": 10})");
}

// A limit that there is not is null.
json limits(const std::vector<double>& numbers) {
  json all = json::array();
  for (const double one : numbers) all.push_back(std::isfinite(one) ? json(one) : json());
  return all;
}

json json_of(const ParameterForm& form) {
  return {{"name", form.name},
          {"of", form.is_control ? "camera" : "scanner"},
          {"type", form.type},
          {"unit", form.unit},
          {"words", form.words},
          {"minimum", limits(form.minimum)},
          {"maximum", limits(form.maximum)},
          {"writable", form.is_writable},
          {"if_not_given", form.if_not_given},
          {"help", form.help},
          {"value", to_json(form.value)},
          {"at_start", to_json(form.at_start)}};
}

json json_of(const Event& finding) {
  return {{"code", finding.code.word()},
          {"severity", to_string(finding.severity)},
          {"what", finding.message},
          {"cure", finding.advice}};
}

template <typename Things>
json list_of(const Things& things) {
  json all = json::array();
  for (const auto& one : things) all.push_back(json_of(one));
  return all;
}

json object_of(const std::vector<Parameter>& parameters) {
  json all = json::object();
  for (const Parameter& one : parameters) all[one.name] = to_json(one.value);
  return all;
}

template <typename Call>
auto& required(Call& call) {
  if (call) return call;
  throw Error(ErrorKind::kUnsupported, "this program takes no commands");
}

}  // namespace

WebApi::WebApi(const HeadWatch& watch, ScanPieces& pieces, std::function<WebCounts()> counts)
    : watch_(watch), pieces_(pieces), counts_(std::move(counts)) {}

void WebApi::set_services(const SinkServices& services) {
  const std::string token = services.token ? services.token() : std::string();
  const std::lock_guard lock(mutex_);
  services_ = services;
  token_ = token;
}

void WebApi::set_events(const EventPort& events) {
  const std::lock_guard lock(mutex_);
  events_ = events;
}

void WebApi::see(const HeadInfo& head) {
  const std::lock_guard lock(mutex_);
  std::erase_if(opened_, [&](const HeadInfo& other) { return other.head == head.head; });
  opened_.push_back(head);
}

SinkServices WebApi::asked() const {
  const std::lock_guard lock(mutex_);
  return services_;
}

std::string WebApi::token() const {
  const std::lock_guard lock(mutex_);
  return token_;
}

void WebApi::note_refusal(const std::string& address) {
  EventPort events;
  {
    const std::lock_guard lock(mutex_);
    events = events_;
  }
  events.send({"command_refused", fmt::format("{} showed a wrong secret", address)});
}

std::vector<std::string> WebApi::heads() const {
  std::vector<std::string> names;
  const SinkServices services = asked();
  if (!services.heads) return names;
  for (const ServedHead& one : services.heads()) names.push_back(one.name);
  return names;
}

bool WebApi::is_slow(const HttpAsk& ask) const {
  const std::string_view path = Target(ask.target).path;
  return path.starts_with(kHeads) || path.starts_with(kRecordings) || path == kWhy ||
         path == kStopPlaying;
}

bool WebApi::is_free_to_all(const HttpAsk& ask) const {
  const std::string_view path = Target(ask.target).path;
  if (ask.method != "POST" || !path.starts_with(kHeads)) return false;
  const CommandWord* const command = find_command(path.substr(path.rfind('/') + 1));
  return command != nullptr && !command->needs_token;
}

bool WebApi::is_free_to_all(std::uint32_t service) const {
  const CommandWord* const command = command_of_service(service, heads().size());
  return command != nullptr && !command->needs_token;
}

HttpAnswer WebApi::answer(const HttpAsk& ask) {
  try {
    const std::string_view path = Target(ask.target).path;
    if (path.starts_with(kHeads)) return answer_of_head(ask);
    if (path.starts_with(kRecordings)) return recording(ask);
    if (path == kStopPlaying) return play(ask, {});
    if (path == kWhy) return why(ask);
    return ask.method == "GET" || ask.method == "HEAD" ? look(ask) : change(ask);
  } catch (const Error& error) {
    return failure(status_of(error.kind()), error.what());
  } catch (const std::exception& error) {
    return failure(500, error.what());
  }
}

HttpAnswer WebApi::look(const HttpAsk& ask) {
  const Target target(ask.target);
  HttpAnswer answer;
  if (target.path == "/healthz") {
    answer.type = kText;
    answer.body = "alive\n";
  } else if (target.path == "/readyz") {
    answer = watch_.readiness();
  } else if (target.path == "/metrics") {
    answer.type = "text/plain; version=0.0.4; charset=utf-8";
    answer.body = watch_.metrics(counts_());
  } else if (target.path == "/api/v1/status") {
    answer.body = watch_.status_json();
  } else if (target.path == "/api/v1/events") {
    answer.body = watch_.events_json(number(target.value("since")));
  } else if (target.path == "/api/v1/model") {
    answer = model(decoded(target.value("head")));
  } else if (target.path == "/api/v1/recordings") {
    answer = recordings();
  } else if (target.path == "/api/v1/pieces") {
    answer = pieces(target.value("head"), target.value("laser"));
  } else if (target.path == "/api/v1/login") {
    answer = done({{"may_change", ask.has_token}});
  } else if (const PageFile* const file = find_page_file(target.path)) {
    answer.type = file->type;
    answer.body = file->content;
  } else {
    answer = failure(404, "there is nothing here");
  }
  return answer;
}

HttpAnswer WebApi::change(const HttpAsk& ask) {
  const Target target(ask.target);
  if (target.path != "/api/v1/login") {
    const unsigned status = look({"GET", ask.target, {}, false}).status;
    return status == 404 ? failure(404, "there is nothing here") : not_allowed("GET, HEAD");
  }
  return ask.method == "POST" ? login(ask) : not_allowed("GET, HEAD, POST");
}

HttpAnswer WebApi::login(const HttpAsk& ask) const {
  const json request = object_of(ask);
  const auto shown = request.find("token");
  const std::string right = token();
  const bool is_right = shown != request.end() && shown->is_string() && !right.empty() &&
                        is_same_secret(shown->get_ref<const std::string&>(), right);
  if (!is_right) return failure(401, "this is not the secret");
  HttpAnswer answer = done(json::object());
  answer.cookie = fmt::format("{}={}; HttpOnly; SameSite=Strict; Path=/", kTokenCookie, right);
  return answer;
}

HttpAnswer WebApi::model(const std::string& head) const {
  const std::lock_guard lock(mutex_);
  for (const HeadInfo& one : opened_) {
    const bool is_meant = head.empty() || one.head == head;
    if (!is_meant || !one.model) continue;
    HttpAnswer answer;
    answer.type = "application/yaml";
    answer.body = format_model(*one.model);
    return answer;
  }
  return failure(404, fmt::format("there is no head '{}' that has a model, yet", head));
}

HttpAnswer WebApi::recordings() const {
  const SinkServices services = asked();
  json all = json::array();
  for (const RecordingFile& one : required(services.recordings)()) {
    all.push_back({{"name", one.name}, {"bytes", one.bytes}, {"time_s", one.time_s}});
  }
  return done(all);
}

HttpAnswer WebApi::pieces(std::string_view head, std::string_view laser) {
  const std::vector<std::string> all = heads();
  const std::string name = head.empty() && !all.empty() ? all[0] : decoded(head);
  HttpAnswer answer;
  answer.body = pieces_.json(name, static_cast<int>(number(laser) % 256));
  return answer;
}

// "/api/v1/recordings/NAME", ".../NAME/info", ".../NAME/play".
HttpAnswer WebApi::recording(const HttpAsk& ask) const {
  const std::string_view rest = Target(ask.target).path.substr(kRecordings.size());
  const std::size_t slash = std::min(rest.find('/'), rest.size());
  const std::string name = decoded(rest.substr(0, slash));
  const std::string_view word = rest.substr(slash);
  if (word == "/play") return play(ask, name);
  if (!word.empty() && word != "/info") return failure(404, "there is nothing here");
  if (ask.method != "GET" && ask.method != "HEAD") return not_allowed("GET, HEAD");
  const SinkServices services = asked();
  HttpAnswer answer;
  if (word == "/info") {
    answer.body = required(services.recording_info)(name) + "\n";
  } else {
    answer.file = required(services.recording_path)(name);
    answer.type = "application/octet-stream";
  }
  return answer;
}

HttpAnswer WebApi::play(const HttpAsk& ask, const std::string& name) const {
  if (ask.method != "POST") return not_allowed("POST");
  if (!ask.has_token) return needs_token();
  const SinkServices services = asked();
  return done({{"message", required(services.play)(name)}});
}

HttpAnswer WebApi::why(const HttpAsk& ask) const {
  if (ask.method != "GET" && ask.method != "HEAD") return not_allowed("GET, HEAD");
  const Target target(ask.target);
  const std::string_view text = target.value("line");
  int line = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), line);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) {
    throw Error(ErrorKind::kBadValue, "which scan line is said as ?line=320: a column, or a row");
  }
  std::string head = decoded(target.value("head"));
  if (const std::vector<std::string> all = heads(); head.empty() && !all.empty()) head = all[0];
  const SinkServices services = asked();
  HttpAnswer answer;
  answer.body = required(services.why)(head, line) + "\n";
  return answer;
}

// "/api/v1/heads/H/WORD", where H may have slashes.
HttpAnswer WebApi::answer_of_head(const HttpAsk& ask) {
  std::string_view rest = Target(ask.target).path.substr(kHeads.size());
  const std::size_t slash = rest.rfind('/');
  if (slash == std::string_view::npos) return failure(404, "there is nothing here");
  const std::string head = decoded(rest.substr(0, slash));
  const std::string_view word = rest.substr(slash + 1);
  if (word == "parameters") return parameters_of(ask, head);
  if (word != "settings" && word != "findings") return command_of(ask, head, word);
  if (ask.method != "GET" && ask.method != "HEAD") return not_allowed("GET, HEAD");
  return look_at_head(head, word);
}

HttpAnswer WebApi::look_at_head(const std::string& head, std::string_view word) const {
  const SinkServices services = asked();
  if (word == "settings") return done(list_of(required(services.parameter_forms)(head)));
  return done(list_of(required(services.findings)(head)));
}

HttpAnswer WebApi::parameters_of(const HttpAsk& ask, const std::string& head) {
  const SinkServices services = asked();
  if (ask.method == "POST") return not_allowed("GET, HEAD, PUT");
  if (ask.method == "PUT") {
    if (!ask.has_token) return needs_token();
    const json wanted = object_of(ask);
    for (const auto& [name, value] : wanted.items()) {
      required(services.set_parameter)(head, parameter_of(name, value));
    }
  }
  return done(object_of(required(services.parameters)(head)));
}

HttpAnswer WebApi::command_of(const HttpAsk& ask, const std::string& head, std::string_view word) {
  const CommandWord* const command = find_command(word);
  if (command == nullptr) return failure(404, "there is nothing here");
  if (ask.method != "POST") return not_allowed("POST");
  if (command->needs_token && !ask.has_token) return needs_token();
  const bool is_record = command->command == HeadCommand::kRecord;
  const double seconds = is_record ? seconds_of(object_of(ask)) : 0.0;
  const SinkServices services = asked();
  return done({{"message", required(services.command)(head, command->command, seconds)}});
}

// Each head has all commands, in order.
std::vector<foxglove::Service> WebApi::services() const {
  std::vector<foxglove::Service> all;
  for (const std::string& head : heads()) {
    for (const CommandWord& one : kCommands) {
      all.push_back({static_cast<std::uint32_t>(all.size() + 1), slashed(head, one.word),
                     one.request_schema});
    }
  }
  return all;
}

std::vector<Parameter> WebApi::parameters(std::span<const std::string> names) {
  const SinkServices services = asked();
  std::vector<Parameter> found;
  for (const std::string& head : heads()) {
    for (Parameter& one : required(services.parameters)(head)) {
      one.name = slashed(head, one.name);
      const bool is_wanted = names.empty() || std::count(names.begin(), names.end(), one.name) > 0;
      if (is_wanted) found.push_back(std::move(one));
    }
  }
  return found;
}

void WebApi::set_parameter(const Parameter& wanted) {
  const SinkServices services = asked();
  for (const std::string& head : heads()) {
    const std::string before = slashed(head, {});
    if (!wanted.name.starts_with(before)) continue;
    return required(services.set_parameter)(head,
                                            {wanted.name.substr(before.size()), wanted.value});
  }
  throw Error(ErrorKind::kNotFound, fmt::format("there is no parameter '{}'", wanted.name));
}

std::string WebApi::call(std::uint32_t service, std::string_view request, bool has_token) {
  const std::vector<std::string> names = heads();
  const CommandWord* const command = command_of_service(service, names.size());
  if (command == nullptr) {
    throw Error(ErrorKind::kNotFound, fmt::format("there is no service {}", service));
  }
  HttpAsk ask{"POST", {}, std::string(request), has_token};
  const HttpAnswer answer = command_of(ask, names[(service - 1) / kOfHead], command->word);
  if (answer.status == 200) return answer.body;
  throw Error(ErrorKind::kUnsupported, parse_json(answer.body)["error"].get<std::string>());
}

}  // namespace striper::detail
