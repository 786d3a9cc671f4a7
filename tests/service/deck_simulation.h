/// A simulation of a deck that stands in a test.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>

#include "simulation/load.h"
#include "simulation/simulation.h"

namespace mbcosim::server {

/// Null, and the test has failed, when the deck is refused or cannot start.
inline std::unique_ptr<Simulation> simulation_of(const std::string& deck) {
  const LoadReport report =
      load_deck(BundleSource(std::map<std::string, std::string>{{"deck.mbd", deck}}), "deck.mbd");
  for (const Diagnostic& d : report.diagnostics) EXPECT_NE(d.severity, Severity::error) << d.text();
  if (!report.ok()) return nullptr;
  auto created = Simulation::create(report.model);
  EXPECT_TRUE(created) << created.error().message;
  return created ? std::move(*created) : nullptr;
}

}  // namespace mbcosim::server
