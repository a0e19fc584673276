// SPDX-License-Identifier: Apache-2.0
#include "genicam_xml.hpp"

#include <initializer_list>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "feature_registers.hpp"
#include "gige/pictures/pixel_layout.hpp"
#include "gige/protocol/gvcp.hpp"

namespace striper::detail {
namespace {

/// Writes GenApi nodes (GenICam GenApi 2.0, schema 1.1), each feature with its register.
class Description {
 public:
  using Entry = std::pair<std::string, std::uint32_t>;

  explicit Description(const std::set<std::string>& lacking) : lacking_(lacking) {}

  void category(const std::string& name) { categories_.push_back({name, {}}); }

  /// An integer register with bounds; `limits` are Min, Max, Inc or pMax elements.
  void integer(const std::string& name, std::uint32_t address, const std::string& limits,
               const char* access = "RW") {
    if (!add(name)) return;
    nodes_ +=
        fmt::format("<Integer Name=\"{0}\"><pValue>{0}Reg</pValue>{1}</Integer>\n", name, limits);
    register_node(name, address, access);
  }

  /// A number that the register holds `per_unit` times.
  void number(const std::string& name, std::uint32_t address, double per_unit, double low,
              double high, const char* unit) {
    if (!add(name)) return;
    nodes_ += fmt::format(
        "<Float Name=\"{0}\"><pValue>{0}Converter</pValue><Min>{1}</Min><Max>{2}</Max>"
        "<Unit>{3}</Unit></Float>\n"
        "<Converter Name=\"{0}Converter\"><FormulaTo>FROM * {4}</FormulaTo>"
        "<FormulaFrom>TO / {4}</FormulaFrom><pValue>{0}Reg</pValue></Converter>\n",
        name, low, high, unit, per_unit);
    register_node(name, address, "RW");
  }

  void choice(const std::string& name, std::uint32_t address, const std::vector<Entry>& entries,
              const std::string& selected = "") {
    if (!add(name)) return;
    nodes_ += fmt::format("<Enumeration Name=\"{}\">", name);
    for (const auto& [entry, value] : entries) {
      if (lacking_.count(fmt::format("{}.{}", name, entry)) != 0) continue;
      nodes_ += fmt::format("<EnumEntry Name=\"{}\"><Value>{}</Value></EnumEntry>", entry, value);
    }
    nodes_ += fmt::format("<pValue>{}Reg</pValue>{}</Enumeration>\n", name, selected);
    register_node(name, address, "RW");
  }

  void boolean(const std::string& name, std::uint32_t address) {
    if (!add(name)) return;
    nodes_ += fmt::format(
        "<Boolean Name=\"{0}\"><pValue>{0}Reg</pValue><OnValue>1</OnValue><OffValue>0</OffValue>"
        "</Boolean>\n",
        name);
    register_node(name, address, "RW");
  }

  void command(const std::string& name, std::uint32_t address, std::uint32_t value) {
    if (!add(name)) return;
    nodes_ += fmt::format(
        "<Command Name=\"{0}\"><pValue>{0}Reg</pValue><CommandValue>{1}</CommandValue></Command>\n",
        name, value);
    register_node(name, address, "RW");
    names_.commands[{address, value}] = name;
  }

  void text(const std::string& name, std::uint32_t address, int length) {
    if (!add(name)) return;
    nodes_ += fmt::format(
        "<StringReg Name=\"{}\"><Address>0x{:x}</Address><Length>{}</Length>"
        "<AccessMode>RO</AccessMode><pPort>Device</pPort></StringReg>\n",
        name, address, length);
  }

  void raw(const std::string& name, const std::string& xml) {
    if (add(name)) nodes_ += xml;
  }

  /// Nodes that no category shows.
  void hidden(const std::string& xml) { nodes_ += xml; }

  const RegisterNames& names() const noexcept { return names_; }

  std::string finish() const {
    std::string xml =
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
        "<RegisterDescription ModelName=\"VirtualStriper\" VendorName=\"Striper\" "
        "ToolTip=\"A simulated laser striper\" StandardNameSpace=\"GEV\" SchemaMajorVersion=\"1\" "
        "SchemaMinorVersion=\"1\" SchemaSubMinorVersion=\"0\" MajorVersion=\"1\" "
        "MinorVersion=\"0\" SubMinorVersion=\"0\" "
        "ProductGuid=\"5f0c6f0e-2f0b-4d62-9d1c-7b9c3d0a5e11\" "
        "VersionGuid=\"5f0c6f0e-2f0b-4d62-9d1c-7b9c3d0a5e12\" "
        "xmlns=\"http://www.genicam.org/GenApi/Version_1_1\" "
        "xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\">\n";
    xml += "<Category Name=\"Root\">";
    for (const auto& [name, features] : categories_) xml += "<pFeature>" + name + "</pFeature>";
    xml += "</Category>\n";
    for (const auto& [name, features] : categories_) {
      xml += fmt::format("<Category Name=\"{}\">", name);
      for (const std::string& feature : features) xml += "<pFeature>" + feature + "</pFeature>";
      xml += "</Category>\n";
    }
    return xml + nodes_ +
           "<Port Name=\"Device\"/>\n"
           "<Port Name=\"LineStatusChunk\"><ChunkID>" +
           fmt::format("{:08x}", kLineChunk) +
           "</ChunkID></Port>\n<Port Name=\"EncoderChunk\"><ChunkID>" +
           fmt::format("{:08x}", kEncoderChunk) + "</ChunkID></Port>\n</RegisterDescription>\n";
  }

 private:
  bool add(const std::string& name) {
    if (lacking_.count(name) != 0) return false;
    categories_.back().second.push_back(name);
    return true;
  }

  void register_node(const std::string& name, std::uint32_t address, const char* access) {
    nodes_ += fmt::format(
        "<IntReg Name=\"{}Reg\"><Address>0x{:x}</Address><Length>4</Length>"
        "<AccessMode>{}</AccessMode><pPort>Device</pPort><Cachable>NoCache</Cachable>"
        "<Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>\n",
        name, address, access);
    names_.registers.emplace(address, name);
  }

  const std::set<std::string>& lacking_;
  std::vector<std::pair<std::string, std::vector<std::string>>> categories_;
  std::string nodes_;
  RegisterNames names_;
};

std::string bounds(std::uint32_t low, std::uint32_t high) {
  return fmt::format("<Min>{}</Min><Max>{}</Max>", low, high);
}

/// Sensor / binning - `used`: what is left for a size or an offset.
std::string room(const std::string& name, const std::string& sensor, const std::string& binning,
                 const std::string& used) {
  return fmt::format(
      "<IntSwissKnife Name=\"{}\"><pVariable Name=\"S\">{}</pVariable>"
      "<pVariable Name=\"B\">{}</pVariable><pVariable Name=\"U\">{}</pVariable>"
      "<Formula>S / B - U</Formula></IntSwissKnife>\n",
      name, sensor, binning, used);
}

void add_device(Description& d) {
  d.category("DeviceControl");
  d.text("DeviceVendorName", gvcp::kManufacturer, 32);
  d.text("DeviceModelName", gvcp::kModel, 32);
  d.text("DeviceVersion", gvcp::kDeviceVersion, 32);
  d.text("DeviceSerialNumber", gvcp::kSerial, 16);
  d.text("DeviceUserID", gvcp::kUserName, 16);
}

void add_image_format(Description& d) {
  d.category("ImageFormatControl");
  d.integer("SensorWidth", kRegSensorWidth, "", "RO");
  d.integer("SensorHeight", kRegSensorHeight, "", "RO");
  d.integer("Width", kRegWidth, "<Min>4</Min><pMax>WidthRoom</pMax><Inc>4</Inc>");
  d.integer("Height", kRegHeight, "<Min>1</Min><pMax>HeightRoom</pMax>");
  d.integer("OffsetX", kRegOffsetX, "<Min>0</Min><pMax>OffsetXRoom</pMax>");
  d.integer("OffsetY", kRegOffsetY, "<Min>0</Min><pMax>OffsetYRoom</pMax>");
  d.integer("BinningHorizontal", kRegBinningHorizontal, bounds(1, 4));
  d.integer("BinningVertical", kRegBinningVertical, bounds(1, 4));
  d.hidden(room("WidthRoom", "SensorWidthReg", "BinningHorizontalReg", "OffsetXReg"));
  d.hidden(room("HeightRoom", "SensorHeightReg", "BinningVerticalReg", "OffsetYReg"));
  d.hidden(room("OffsetXRoom", "SensorWidthReg", "BinningHorizontalReg", "WidthReg"));
  d.hidden(room("OffsetYRoom", "SensorHeightReg", "BinningVerticalReg", "HeightReg"));
  std::vector<Description::Entry> formats;
  for (const PixelLayout& layout : known_layouts()) {
    if (layout.mosaic == Mosaic::kNone && layout.channels() == 1) {
      formats.emplace_back(layout.name, layout.code);
    }
  }
  d.choice("PixelFormat", kRegPixelFormat, formats);
}

void add_acquisition(Description& d) {
  d.category("AcquisitionControl");
  d.choice("AcquisitionMode", kRegAcquisitionMode, {{"Continuous", 0}});
  d.command("AcquisitionStart", kRegAcquisition, 1);
  d.command("AcquisitionStop", kRegAcquisition, 0);
  d.number("AcquisitionFrameRate", kRegRate, 1e3, 0.1, 1000.0, "Hz");
  d.number("ExposureTime", kRegExposure, 1e3, 1.0, 1e6, "us");
  d.choice("TriggerSelector", kRegTriggerSelector, {{"FrameStart", 0}});
  d.choice("TriggerMode", kRegTriggerMode, {{"Off", 0}, {"On", 1}});
  d.choice("TriggerSource", kRegTriggerSource, {{"Software", 0}, {"Line1", 1}, {"Action1", 2}});
  d.command("TriggerSoftware", kRegTriggerSoftware, 1);
  d.category("ActionControl");
  d.integer("ActionDeviceKey", gvcp::kActionDeviceKey, bounds(0, 0xffffffff), "WO");
  d.integer("ActionSelector", kRegActionSelector, bounds(1, 1));
  d.integer("ActionGroupKey", gvcp::kActionGroupKey, bounds(0, 0xffffffff));
  d.integer("ActionGroupMask", gvcp::kActionGroupMask, bounds(0, 0xffffffff));
  d.category("AnalogControl");
  d.number("Gain", kRegGain, 1e3, 0.0, 24.0, "dB");
  d.integer("BlackLevel", kRegBlackLevel, bounds(0, 255));
}

void add_lines(Description& d) {
  d.category("DigitalIOControl");
  d.choice("LineSelector", kRegLineSelector,
           {{"Line0", 0}, {"Line1", 1}, {"Line2", 2}, {"Line3", 3}},
           "<pSelected>LineMode</pSelected><pSelected>LineSource</pSelected>");
  d.choice("LineMode", kRegLineMode, {{"Input", 0}, {"Output", 1}});
  d.choice("LineSource", kRegLineSource,
           {{"Off", 0}, {"ExposureActive", 1}, {"UserOutput1", 2}, {"UserOutput2", 3}});
  d.integer("LineStatusAll", kRegLineStatusAll, "", "RO");
  d.choice("UserOutputSelector", kRegUserOutputSelector, {{"UserOutput1", 0}, {"UserOutput2", 1}},
           "<pSelected>UserOutputValue</pSelected>");
  d.boolean("UserOutputValue", kRegUserOutputValue);
}

void add_sequencer(Description& d) {
  d.category("SequencerControl");
  d.choice("SequencerMode", kRegSequencerMode, {{"Off", 0}, {"On", 1}});
  d.choice("SequencerConfigurationMode", kRegSequencerConfiguration, {{"Off", 0}, {"On", 1}});
  d.integer("SequencerSetSelector", kRegSequencerSet, bounds(0, kSequencerSets - 1));
  d.integer("SequencerPathSelector", kRegSequencerPath, bounds(0, 0));
  d.integer("SequencerSetNext", kRegSequencerNext, bounds(0, kSequencerSets - 1));
  d.integer("SequencerSetStart", kRegSequencerStart, bounds(0, kSequencerSets - 1));
  d.command("SequencerSetSave", kRegSequencerSave, 1);
}

void add_chunks(Description& d) {
  d.category("ChunkDataControl");
  d.boolean("ChunkModeActive", kRegChunkMode);
  d.choice("ChunkSelector", kRegChunkSelector, {{"LineStatusAll", 0}, {"EncoderValue", 1}},
           "<pSelected>ChunkEnable</pSelected>");
  d.boolean("ChunkEnable", kRegChunkEnable);
  for (const auto& [name, port] : {std::pair{"ChunkLineStatusAll", "LineStatusChunk"},
                                   std::pair{"ChunkEncoderValue", "EncoderChunk"}}) {
    d.raw(name,
          fmt::format("<Integer Name=\"{0}\"><pValue>{0}Reg</pValue></Integer>\n"
                      "<IntReg Name=\"{0}Reg\"><Address>0x0</Address><Length>4</Length>"
                      "<AccessMode>RO</AccessMode><pPort>{1}</pPort><Cachable>NoCache</Cachable>"
                      "<Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>\n",
                      name, port));
  }
}

void add_transport(Description& d) {
  d.category("TransportLayerControl");
  d.integer("PayloadSize", kRegPayloadSize, "", "RO");
  d.integer("GevHeartbeatTimeout", gvcp::kHeartbeatTimeout, bounds(500, 60000));
  d.raw("GevSCPSPacketSize",
        "<Integer Name=\"GevSCPSPacketSize\"><pValue>GevSCPSPacketSizeReg</pValue>"
        "<Min>576</Min><Max>16000</Max><Inc>4</Inc></Integer>\n"
        "<MaskedIntReg Name=\"GevSCPSPacketSizeReg\"><Address>0xd04</Address><Length>4</Length>"
        "<AccessMode>RW</AccessMode><pPort>Device</pPort><Cachable>NoCache</Cachable>"
        "<LSB>31</LSB><MSB>16</MSB><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess>"
        "</MaskedIntReg>\n");
  d.raw("GevSCPSFireTestPacket",
        "<Command Name=\"GevSCPSFireTestPacket\"><pValue>GevSCPSFireTestPacketReg</pValue>"
        "<CommandValue>1</CommandValue></Command>\n"
        "<MaskedIntReg Name=\"GevSCPSFireTestPacketReg\"><Address>0xd04</Address>"
        "<Length>4</Length><AccessMode>RW</AccessMode><pPort>Device</pPort>"
        "<Cachable>NoCache</Cachable><Bit>0</Bit><Endianess>BigEndian</Endianess>"
        "</MaskedIntReg>\n");
  d.integer("GevSCPD", gvcp::kStreamPacketDelay, bounds(0, 1'000'000));
  d.boolean("PtpEnable", kRegPtpEnable);
  d.command("PtpDataSetLatch", kRegPtpLatch, 1);
  const std::vector<Description::Entry> ptp_states{{"Disabled", 3}, {"Listening", 4}, {"Slave", 9}};
  d.choice("PtpStatus", kRegPtpStatus, ptp_states);
  d.boolean("GevIEEE1588", kRegPtpEnable);  // as it was called before
  d.choice("GevIEEE1588Status", kRegIeee1588Status, ptp_states);
  d.hidden("<Integer Name=\"TLParamsLocked\"><Value>0</Value><Min>0</Min><Max>1</Max></Integer>\n");
  d.category("TestControl");
  d.integer("TestLostPacketsPpm", kRegLostPackets, bounds(0, 1'000'000));
}

Description describe_camera(const std::set<std::string>& lacking) {
  Description description(lacking);
  add_device(description);
  add_image_format(description);
  add_acquisition(description);
  add_lines(description);
  add_sequencer(description);
  add_chunks(description);
  add_transport(description);
  return description;
}

}  // namespace

std::string genicam_xml(const std::set<std::string>& lacking) {
  return describe_camera(lacking).finish();
}

RegisterNames register_names(const std::set<std::string>& lacking) {
  return describe_camera(lacking).names();
}

}  // namespace striper::detail
