/// Reader and writer of the packed form of FEM data files (little-endian; "bmod", version 4, then
/// groups).

#include <bit>
#include <cstdint>
#include <cstring>

#include "elements/modal/fem_data.h"

namespace mbcosim {

static_assert(std::endian::native == std::endian::little,
              "the packed FEM data format is little-endian");

namespace {

constexpr std::uint32_t kVersion = 4;
constexpr unsigned char kEnd = 0xFF;

class FemBinaryReader {
 public:
  FemBinaryReader(const std::string& name, std::string_view bytes) : bytes_(bytes) {
    data_.name = name;
    data_.binary = true;
  }

  FemData read() {
    pos_ = 4;  // "bmod"
    const auto version = read_value<std::uint32_t>();
    if (version != kVersion)
      fail("version " + std::to_string(version) + " of the binary format is not supported; 4 is");
    read_header();
    while (true) {
      const int group = read_value<unsigned char>();
      if (group == kEnd) break;
      if (group < 2 || group > 13) detail::refuse_fem_group(data_.name, 0, group);
      if (have_[group]) fail("record group " + std::to_string(group) + " appears a second time");
      have_[group] = true;
      data_.groups.push_back(group);
      read_group(group);
    }
    finish();
    if (pos_ < bytes_.size())
      detail::note_fem_data(
          data_, 0, std::to_string(bytes_.size() - pos_) + " bytes after the end are ignored");
    return std::move(data_);
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    detail::refuse_fem_data(data_.name, 0, message + " (byte " + std::to_string(pos_) + ")");
  }
  void need(std::size_t bytes) const {
    if (bytes_.size() - pos_ < bytes) fail("the binary file is truncated");
  }
  template <class T>
  T read_value() {
    need(sizeof(T));
    T v;
    std::memcpy(&v, bytes_.data() + pos_, sizeof v);
    pos_ += sizeof v;
    return v;
  }
  void read_header() {
    if (read_value<unsigned char>() != 1)
      fail("the binary file does not start with record group 1");
    const auto nodes = read_value<std::uint32_t>(), modes = read_value<std::uint32_t>();
    if (nodes < 1 || modes < 1) fail("the header announces no node or no mode");
    const double left = static_cast<double>(bytes_.size());
    if (8.0 * (double(nodes) * (3 + 6.0 * modes) + 2.0 * modes * modes) > left)
      fail("the header announces " + std::to_string(nodes) + " nodes and " + std::to_string(modes) +
           " modes, more than the file can hold");
    nodes_ = static_cast<int>(nodes);
    modes_ = static_cast<int>(modes);
    data_.normal = modes_;
    data_.groups.push_back(1);
  }
  MatX values(int rows, int columns) {
    const std::size_t count = static_cast<std::size_t>(rows) * columns;
    need(8 * count);
    MatX by_rows(columns, rows);
    std::memcpy(by_rows.data(), bytes_.data() + pos_, 8 * count);
    pos_ += 8 * count;
    return by_rows.transpose();
  }
  void read_group(int group) {
    const int n = nodes_, m = modes_;
    switch (group) {
      case 2:
        for (int i = 0; i < n; ++i) {
          const auto length = read_value<std::uint32_t>();
          need(length);
          data_.labels.emplace_back(bytes_.substr(pos_, length));
          pos_ += length;
        }
        return;
      case 3:
        data_.initial_amplitudes = values(m, 1);
        return;
      case 4:
        data_.initial_velocities = values(m, 1);
        return;
      case 5:
      case 6:
      case 7:
        if (data_.positions.size() == 0) data_.positions.setZero(3, n);
        data_.positions.row(group - 5) = values(n, 1).transpose();
        return;
      case 8:
        data_.shapes = values(m, 6 * n).transpose();
        return;
      case 9:
        data_.mass = values(m, m);
        return;
      case 10:
        data_.stiffness = values(m, m);
        return;
      case 11:
        data_.lumped = values(n, 6).transpose();
        return;
      case 12: {
        const MatX v = values(13, 1);
        data_.rigid = FemRigidInertia{v(0), v.block<3, 1>(1, 0),
                                      Eigen::Map<const Mat3>(v.data() + 4).transpose()};
        return;
      }
      case 13:
        data_.damping = values(m, m);
        return;
    }
  }
  void finish() {
    std::string missing;
    for (const int group : {2, 5, 6, 7, 8, 9, 10})
      if (!have_[group]) missing += (missing.empty() ? "" : ", ") + std::to_string(group);
    if (!missing.empty()) fail("record groups are missing: " + missing);
    if (data_.initial_amplitudes.size() == 0) data_.initial_amplitudes.setZero(modes_);
    if (data_.initial_velocities.size() == 0) data_.initial_velocities.setZero(modes_);
    detail::check_fem_data(data_);
  }

  std::string_view bytes_;
  std::size_t pos_ = 0;
  FemData data_;
  int nodes_ = 0, modes_ = 0;
  bool have_[14] = {};
};

class FemBinaryWriter {
 public:
  template <class T>
  void put(T v) {
    out_.append(reinterpret_cast<const char*>(&v), sizeof v);
  }
  void text(const std::string& s) { out_ += s; }
  void group(int number) { put(static_cast<unsigned char>(number)); }
  void rows(const MatX& m) {
    const MatX by_rows = m.transpose();
    out_.append(reinterpret_cast<const char*>(by_rows.data()), 8 * by_rows.size());
  }
  std::string release() { return std::move(out_); }

 private:
  std::string out_;
};

}  // namespace

namespace detail {

FemData parse_fem_binary(const std::string& name, std::string_view bytes) {
  return FemBinaryReader(name, bytes).read();
}

}  // namespace detail

std::string write_fem_binary(const FemData& data) {
  FemBinaryWriter out;
  out.text("bmod");
  out.put(kVersion);
  out.group(1);
  out.put(static_cast<std::uint32_t>(data.node_count()));
  out.put(static_cast<std::uint32_t>(data.mode_count()));
  out.group(2);
  for (const std::string& label : data.labels) {
    out.put(static_cast<std::uint32_t>(label.size()));
    out.text(label);
  }
  const auto matrix = [&](int group, const MatX& m) {
    out.group(group);
    out.rows(m);
  };
  matrix(3, data.initial_amplitudes);
  matrix(4, data.initial_velocities);
  for (int a = 0; a < 3; ++a) matrix(5 + a, data.positions.row(a));
  matrix(8, data.shapes.transpose());
  matrix(9, data.mass);
  matrix(10, data.stiffness);
  if (data.lumped) matrix(11, data.lumped->transpose());
  if (data.rigid) {
    matrix(12, MatX::Constant(1, 1, data.rigid->mass));
    out.rows(data.rigid->center);
    out.rows(data.rigid->inertia);
  }
  if (data.damping) matrix(13, *data.damping);
  out.group(kEnd);
  return out.release();
}

}  // namespace mbcosim
