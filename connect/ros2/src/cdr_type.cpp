// SPDX-License-Identifier: Apache-2.0
#include "cdr_type.hpp"

#include <algorithm>
#include <cstring>
#include <memory>
#include <vector>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>

// Cyclone DDS 0.10.2, dds/ddsi/ddsi_sertype.h and ddsi_serdata.h: what a type and a sample must be
// able to do. What only readers ask for is left empty; the types have no keys.
namespace striper::detail {
namespace {

struct CdrType : ddsi_sertype {};

// A sample on its way to the network, which may ask for up to 3 bytes beyond its end.
struct CdrData : ddsi_serdata {
  std::size_t size = 0;
  std::vector<std::uint8_t> bytes;
};

const CdrData& data_of(const ddsi_serdata* data) { return *static_cast<const CdrData*>(data); }

ddsi_serdata* from_sample(const ddsi_sertype* type, ddsi_serdata_kind kind, const void* sample) {
  constexpr std::size_t kWord = 4;
  const CdrSample& cdr = *static_cast<const CdrSample*>(sample);
  auto data = std::make_unique<CdrData>();
  ddsi_serdata_init(data.get(), type, kind);
  data->hash = type->serdata_basehash;
  data->size = cdr.size();
  data->bytes.reserve((cdr.size() + kWord - 1) / kWord * kWord);
  data->bytes.assign(cdr.begin(), cdr.end());
  data->bytes.resize((cdr.size() + kWord - 1) / kWord * kWord);
  return data.release();
}

// What tells instances apart, which types without keys have one of.
ddsi_serdata* to_untyped(const ddsi_serdata* data) {
  auto key = std::make_unique<CdrData>();
  ddsi_serdata_init(key.get(), data->type, SDK_KEY);
  key->hash = data->type->serdata_basehash;
  key->type = nullptr;
  return key.release();
}

void to_ser(const ddsi_serdata* data, std::size_t offset, std::size_t size, void* out) {
  std::memcpy(out, data_of(data).bytes.data() + offset, size);
}

ddsi_serdata* to_ser_ref(const ddsi_serdata* data, std::size_t offset, std::size_t size,
                         ddsrt_iovec_t* reference) {
  reference->iov_base = const_cast<std::uint8_t*>(data_of(data).bytes.data() + offset);
  reference->iov_len = static_cast<ddsrt_iov_len_t>(size);
  return ddsi_serdata_ref(data);
}

void to_ser_unref(ddsi_serdata* data, const ddsrt_iovec_t* /*reference*/) {
  ddsi_serdata_unref(data);
}

std::size_t print(const ddsi_sertype* /*type*/, const ddsi_serdata* data, char* out,
                  std::size_t size) {
  const std::string text = std::to_string(data_of(data).size) + " bytes of CDR";
  const std::size_t length = std::min(text.size(), size - 1);
  std::copy_n(text.begin(), length, out);
  out[length] = '\0';
  return length;
}

const ddsi_serdata_ops& data_operations() {
  static const ddsi_serdata_ops operations = [] {
    ddsi_serdata_ops made{};
    made.eqkey = [](const ddsi_serdata*, const ddsi_serdata*) { return true; };
    made.get_size = [](const ddsi_serdata* data) {
      return static_cast<std::uint32_t>(data_of(data).size);
    };
    made.from_sample = from_sample;
    made.to_ser = to_ser;
    made.to_ser_ref = to_ser_ref;
    made.to_ser_unref = to_ser_unref;
    made.to_untyped = to_untyped;
    made.free = [](ddsi_serdata* data) { delete static_cast<CdrData*>(data); };
    made.print = print;
    made.get_keyhash = [](const ddsi_serdata*, ddsi_keyhash* hash, bool) { *hash = {}; };
    return made;
  }();
  return operations;
}

const ddsi_sertype_ops& type_operations() {
  static const ddsi_sertype_ops operations = [] {
    ddsi_sertype_ops made{};
    made.version = ddsi_sertype_v0;
    made.free = [](ddsi_sertype* type) {
      ddsi_sertype_fini(type);
      delete static_cast<CdrType*>(type);
    };
    made.equal = [](const ddsi_sertype*, const ddsi_sertype*) { return true; };  // By their names.
    made.hash = [](const ddsi_sertype*) { return std::uint32_t{0}; };
    return made;
  }();
  return operations;
}

}  // namespace

ddsi_sertype* make_cdr_type(const std::string& name) {
  auto type = std::make_unique<CdrType>();
  constexpr bool kHasNoKey = true;
  ddsi_sertype_init(type.get(), name.c_str(), &type_operations(), &data_operations(), kHasNoKey);
  type->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  return type.release();
}

}  // namespace striper::detail
