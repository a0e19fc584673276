// SPDX-License-Identifier: Apache-2.0
#include "dds_domain.hpp"

#include <map>
#include <mutex>
#include <string_view>

#include <dds/ddsrt/log.h>
#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper::detail {
namespace {

// Keeps what Cyclone DDS would print of what is wrong, for the error.
class LogKeeper {
 public:
  LogKeeper() { dds_set_log_sink(&LogKeeper::keep, this); }
  LogKeeper(const LogKeeper&) = delete;
  LogKeeper& operator=(const LogKeeper&) = delete;
  ~LogKeeper() { dds_set_log_sink(nullptr, nullptr); }

  const std::string& text() const noexcept { return text_; }

 private:
  static void keep(void* self, const dds_log_data_t* line) {
    auto& text = static_cast<LogKeeper*>(self)->text_;
    if ((line->priority & (DDS_LC_ERROR | DDS_LC_FATAL | DDS_LC_CONFIG)) == 0) return;
    text.append(text.empty() ? "" : "; ").append(line->message, line->size);
    while (!text.empty() && text.back() == '\n') text.pop_back();
  }

  std::string text_;
};

std::shared_ptr<const DdsEntity> domain_of(const Ros2Address& address) {
  static std::mutex mutex;
  static std::map<std::uint32_t, std::weak_ptr<const DdsEntity>> domains;
  const std::lock_guard lock(mutex);
  std::weak_ptr<const DdsEntity>& known = domains[address.domain];
  if (auto domain = known.lock()) return domain;
  const LogKeeper log;
  const dds_entity_t made = dds_create_domain(address.domain, address.configuration().c_str());
  auto domain = std::make_shared<const DdsEntity>(
      made, fmt::format("ROS 2 domain {} on {}: {}", address.domain, address.where(), log.text()));
  known = domain;
  return domain;
}

}  // namespace

DdsEntity::DdsEntity(dds_entity_t handle, const std::string& what) : handle_(handle) {
  if (handle >= 0) return;
  throw Error(ErrorKind::kIo, fmt::format("{} ({})", what, dds_strretcode(handle)));
}

dds_guid_t DdsEntity::guid() const {
  dds_guid_t guid{};
  dds_get_guid(handle_, &guid);
  return guid;
}

DdsEntity::~DdsEntity() { dds_delete(handle_); }

DdsParticipant::DdsParticipant(const Ros2Address& address)
    : domain_(domain_of(address)),
      participant_(dds_create_participant(address.domain, nullptr, nullptr),
                   fmt::format("no participant in ROS 2 domain {}", address.domain)) {}

dds_guid_t DdsParticipant::guid() const { return participant_.guid(); }

void DdsParticipant::claim_enclave() const {
  constexpr std::string_view kEnclave = "enclave=/;";
  const DdsQos qos(dds_create_qos(), dds_delete_qos);
  dds_qset_userdata(qos.get(), kEnclave.data(), kEnclave.size());
  dds_set_qos(handle(), qos.get());
}

}  // namespace striper::detail
