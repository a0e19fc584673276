// SPDX-License-Identifier: Apache-2.0
// Shows what can be set on a source while it streams, and sets it: 03_controls SOURCE
// [NAME=VALUE]... VALUE is a number, on or off, or numbers with commas between them.
#include <iostream>
#include <string_view>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>

void show(const striper::Control& control) {
  const auto text = [&](const striper::ControlValue& value) {
    return striper::format_control(control.type, value);
  };
  std::cout << control.name << '=' << text(control.state.value) << ' ' << control.unit << " ("
            << text(control.state.minimum) << " to " << text(control.state.maximum)
            << (control.state.is_writable ? ")\n" : "; read only)\n");
}

// What the device made of it is read back.
void set(striper::Controls& controls, std::string_view words) {
  const std::string_view name = words.substr(0, words.find('='));
  if (name.size() == words.size()) {
    throw striper::Error(striper::ErrorKind::kUsage, "usage: 03_controls SOURCE [NAME=VALUE]...");
  }
  const striper::ControlType type = controls.get(name).type;
  controls.set(name, striper::parse_control(type, words.substr(name.size() + 1)));
}

int main(int argc, char** argv) try {
  if (argc < 2) throw striper::Error(striper::ErrorKind::kUsage, "usage: 03_controls SOURCE ...");
  const auto source = striper::open_source(argv[1]);
  for (int i = 2; i < argc; ++i) set(source->controls(), argv[i]);
  for (const striper::Control& control : source->controls().list()) show(control);
  return 0;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
