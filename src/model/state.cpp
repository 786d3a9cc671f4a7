#include "model/state.h"

#include <algorithm>

namespace mbcosim {

namespace {

template <class T>
void copy_piece(const std::vector<T>& from, std::vector<T>& to, std::size_t piece,
                std::size_t pieces) {
  std::copy(from.begin() + from.size() * piece / pieces,
            from.begin() + from.size() * (piece + 1) / pieces,
            to.begin() + from.size() * piece / pieces);
}

}  // namespace

void copy_state(const State& from, State& to, ThreadTeam* team) {
  if (!team) {
    to = from;
    return;
  }
  to.time = from.time;
  to.h = from.h;
  to.h_previous = from.h_previous;
  to.step = from.step;
  to.control = from.control;
  for (const auto array : kStateArrays) (to.*array).resize((from.*array).size());
  to.rotation.resize(from.rotation.size());
  to.rotation_history.resize(from.rotation_history.size());
  team->run([&](int thread) {
    for (const auto array : kStateArrays) copy_piece(from.*array, to.*array, thread, team->size());
    copy_piece(from.rotation, to.rotation, thread, team->size());
    copy_piece(from.rotation_history, to.rotation_history, thread, team->size());
  });
}

}  // namespace mbcosim
