/// modelDescription.xml and terminalsAndIcons.xml.
#pragma once

#include <string>
#include <vector>

#include "fmi/catalogue.h"

namespace mbcosim::fmi {

struct DescriptionHead {
  std::string model_name;
  std::string identifier;  ///< name of the shared library without its ending
  std::string token;
  std::string description;
  double start_time = 0, stop_time = 0, step = 0;  ///< default experiment [s]
  bool variable_steps = true;                      ///< communication steps may have any length
};

std::string describe_fmi2(const DescriptionHead& head, const std::vector<Entry>& scalars);
std::string describe_fmi3(const DescriptionHead& head, const std::vector<Entry>& entries);
/// FMI 3: the ports, each with its members; empty when there are none.
std::string describe_terminals(const std::vector<Entry>& entries);

}  // namespace mbcosim::fmi
