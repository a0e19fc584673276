// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>

#include <dlfcn.h>
#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/stream/sink_plugin.hpp>

#include "stream/sinks/built_in.hpp"

namespace striper {
namespace {

// Never closed: its threads may outlive the sink that was left behind with them.
const SinkPlugin& load_plugin(const SinkUri& uri) {
  const std::string library = fmt::format("libstriper-{}.so", uri.scheme());
  void* handle = ::dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) {
    throw Error(ErrorKind::kUnsupported,
                fmt::format("sink '{}': {} (the package striper-{}, or a build where what it needs "
                            "was found, has it)",
                            uri.text(), ::dlerror(), uri.scheme()));
  }
  const auto* plugin = static_cast<const SinkPlugin*>(::dlsym(handle, "striper_sink_plugin"));
  if (plugin == nullptr || std::string_view(plugin->version) != STRIPER_VERSION) {
    throw Error(ErrorKind::kUnsupported,
                fmt::format("sink '{}': {} is of version {}, this is {}", uri.text(), library,
                            plugin == nullptr ? "none" : plugin->version, STRIPER_VERSION));
  }
  return *plugin;
}

}  // namespace

std::unique_ptr<ScanSink> detail::make_plugin_sink(SinkUri uri) {
  const SinkPlugin& plugin = load_plugin(uri);
  return plugin.make(std::move(uri));
}

std::vector<Event> examine_sink(std::string_view uri, std::chrono::milliseconds watch) {
  SinkUri parsed = SinkUri::parse(uri);
  const SinkPlugin& plugin = load_plugin(parsed);
  return plugin.examine(std::move(parsed), watch);
}

}  // namespace striper
