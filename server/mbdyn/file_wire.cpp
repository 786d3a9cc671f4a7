#include "mbdyn/file_wire.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <thread>

namespace mbcosim::mbdyn {
namespace {

using Rotation = ForceForm::Rotation;

void put(const Vec3& v, std::ostream& out) { out << ' ' << v(0) << ' ' << v(1) << ' ' << v(2); }

void put_rotation(const Mat3& R, Rotation form, std::ostream& out) {
  if (form == Rotation::matrix)
    for (int i = 0; i < 3; ++i) put(R.row(i).transpose(), out);
  if (form == Rotation::vector) put(vector_of_rotation(R), out);
  if (form == Rotation::euler123) put(180 / M_PI * euler123_of_rotation(R), out);
}

void put_line(const ForceForm& form, Rotation rotation, const PointState& p,
              const std::string& label, std::ostream& out) {
  const bool rotations = rotation != Rotation::none;
  std::ostringstream line;
  line.copyfmt(out);
  if (form.labels) line << ' ' << label;
  put(p.x, line);
  put_rotation(p.R, rotation, line);
  put(p.v, line);
  if (rotations) put(p.w, line);
  if (form.accelerations) {
    put(p.a, line);
    if (rotations) put(p.wp, line);
  }
  out << line.str().substr(1) << '\n';
}

void put_modal(const ForceForm& form, const ForceState& state, std::ostream& out) {
  const auto line = [&](const Vec3& v) { out << v(0) << ' ' << v(1) << ' ' << v(2) << '\n'; };
  if (form.reference) {
    line(state.reference.x);
    for (int i = 0; i < 3; ++i) line(state.reference.R.row(i).transpose());
    line(state.reference.v);
    line(state.reference.w);
  }
  for (std::size_t k = 0; k < state.q.size(); ++k) out << state.q[k] << ' ' << state.qp[k] << '\n';
}

std::string temporary_of(const ChannelAddress& address) { return address.out + ".tmp"; }

/// Numbers of an answer: with labels one more for each point and the reference node.
struct Counts {
  explicit Counts(const ForceForm& form)
      : with_moment(form.kind == ForceForm::Kind::modal || form.rotation != Rotation::none),
        per_point((form.kind == ForceForm::Kind::nodal && form.rotation != Rotation::none ? 6 : 3) +
                  (form.labels ? 1 : 0)),
        per_reference((with_moment ? 6 : 3) + (form.labels ? 1 : 0)),
        all((form.reference ? per_reference : 0) + form.modes +
            static_cast<std::size_t>(form.points()) * per_point) {}

  bool with_moment;
  int per_point, per_reference;
  std::size_t all;
};

}  // namespace

std::string state_text(const ForceForm& form, const ForceState& state, int precision,
                       bool scientific) {
  std::ostringstream out;
  if (scientific) out << std::scientific;
  out << std::setprecision(precision);
  if (form.kind == ForceForm::Kind::modal) {
    put_modal(form, state, out);
    return out.str();
  }
  if (form.reference) {
    out << "# reference node\n";
    put_line(form, form.rotation, state.reference, std::to_string(form.reference_label), out);
  }
  out << "# regular nodes\n";
  const Rotation rotation = form.kind == ForceForm::Kind::nodal ? form.rotation : Rotation::none;
  for (std::size_t k = 0; k < state.points.size(); ++k)
    put_line(form, rotation, state.points[k],
             form.labels ? std::to_string(form.node_labels[k]) : "", out);
  return out.str();
}

std::vector<std::string> files_changed_at(const ChannelAddress& address) {
  if (address.kind != ChannelAddress::Kind::files) return {};
  std::vector<std::string> files{address.out, temporary_of(address)};
  if (address.unlink) files.push_back(address.in);
  return files;
}

FileWire::FileWire(const ChannelAddress& address, std::string name, ForceForm form,
                   Patience patience)
    : address_(address),
      name_(std::move(name)),
      form_(std::move(form)),
      patience_(std::move(patience)) {}

void FileWire::wait_until(bool exists, const std::string& path) const {
  const auto end = Clock::now() + patience_.time;
  const auto pause = std::min(std::chrono::duration<double>(address_.sleep_time),
                              std::chrono::duration<double>(patience_.time));
  std::error_code error;
  while (std::filesystem::exists(path, error) != exists) {
    if (patience_.cancelled()) throw ChannelLost("interrupted");
    if (Clock::now() > end)
      throw ChannelLost(name_ + ": \"" + path +
                        (exists ? "\" did not appear" : "\" was not taken") + " within " +
                        std::to_string(patience_.time.count() / 1000) + " s");
    std::this_thread::sleep_for(pause);
  }
}

void FileWire::send(Command, const ForceState& state) {
  if (address_.no_clobber) wait_until(false, address_.out);
  const std::string temporary = temporary_of(address_);
  std::ofstream out(temporary, std::ios::trunc);
  out << state_text(form_, state, address_.precision);
  out.close();
  std::error_code error;
  if (out) std::filesystem::rename(temporary, address_.out, error);
  if (!out || error) throw ChannelLost(name_ + ": cannot write \"" + address_.out + "\"");
}

ForceLoads FileWire::parse(const std::string& text) const {
  std::istringstream lines(text);
  std::vector<double> numbers;
  for (std::string line; std::getline(lines, line);) {
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      char* end = nullptr;
      numbers.push_back(std::strtod(word.c_str(), &end));
      if (*end != 0 || !std::isfinite(numbers.back()))
        throw ChannelLost(name_ + ": \"" + address_.in + "\": \"" + word.substr(0, 40) +
                          "\" is no finite number");
    }
  }
  // Brought into the form of a socket's message: labels first, then forces, then moments.
  const Counts counts(form_);
  const int per_point = counts.per_point;
  if (numbers.size() < counts.all)  // what stands behind them is not ours
    throw ChannelLost(name_ + ": \"" + address_.in + "\" has " + std::to_string(numbers.size()) +
                      " numbers, not " + std::to_string(counts.all) + ": " +
                      (form_.labels ? "a label, " : "") + "a force" +
                      (counts.with_moment ? " and a moment" : "") + " for each " +
                      (form_.modes ? "reference node, and a number for each mode" : "point"));
  std::string bytes;
  const auto number = [&](double value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  const auto label = [&](double value) {
    const auto whole = value >= 0 && value < 4294967296.0 ? static_cast<std::uint32_t>(value) : 0u;
    bytes.append(reinterpret_cast<const char*>(&whole), sizeof whole);
  };
  std::size_t at = 0;
  if (form_.reference) {
    if (form_.labels) {
      label(numbers[at++]);
      label(0);
    }
    for (int i = 0; i < (counts.with_moment ? 6 : 3); ++i) number(numbers[at++]);
  }
  for (int k = 0; k < form_.modes; ++k) number(numbers[at++]);
  const int skip = form_.labels ? 1 : 0;
  for (int k = 0; form_.labels && k < form_.points(); ++k) label(numbers[at + k * per_point]);
  if (form_.labels && form_.points() % 2 != 0) label(0);
  for (int part = 0; part < (per_point - skip) / 3; ++part)
    for (int k = 0; k < form_.points(); ++k)
      for (int i = 0; i < 3; ++i) number(numbers[at + k * per_point + skip + 3 * part + i]);
  return decode_loads(form_, bytes);
}

std::string FileWire::read() const {
  constexpr std::size_t kComments = 1 << 20, kNumber = 64;  // [bytes]
  std::string text(kComments + kNumber * Counts(form_).all, '\0');
  std::ifstream in(address_.in, std::ios::binary);
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  const auto size = static_cast<std::size_t>(in.gcount());
  if (in.bad() || !in.is_open()) throw ChannelLost(name_ + ": cannot read \"" + address_.in + "\"");
  if (size == text.size())
    throw ChannelLost(name_ + ": \"" + address_.in +
                      "\" is too long: " + std::to_string(Counts(form_).all) +
                      " numbers are expected, and no more than " + std::to_string(size - 1) +
                      " bytes with their comments");
  text.resize(size);
  return text;
}

Command FileWire::receive(ForceLoads& loads) {
  wait_until(true, address_.in);
  loads = parse(read());
  std::error_code error;
  if (address_.unlink) std::filesystem::remove(address_.in, error);
  return kLastData;
}

}  // namespace mbcosim::mbdyn
