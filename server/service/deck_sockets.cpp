#include "service/deck_sockets.h"

#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>

#include "coupling/port.h"
#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

namespace fs = std::filesystem;
using Kind = ChannelAddress::Kind;

constexpr int kMostWaitingCreations =
    2;  ///< creations that wait for codes: others need their threads
constexpr std::chrono::milliseconds kFarewell{200}, kUsualTimeout{60000};

[[noreturn]] void refuse(const std::string& message) {
  throw Refusal(v1::REASON_DECK_SOCKETS, utf8(message));
}

bool is_inside(const fs::path& path, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first ==
         folder.end();
}

bool is_symbolic_link(const fs::path& path) {
  std::error_code error;
  return fs::is_symlink(fs::symlink_status(path, error));
}

std::chrono::milliseconds timeout_of(const v1::DeckSocketOptions& options) {
  if (!options.has_peer_timeout()) return kUsualTimeout;
  const auto timeout = milliseconds_of(options.peer_timeout(), "deck_sockets.peer_timeout");
  if (timeout <= std::chrono::milliseconds(0) || timeout > std::chrono::hours(1))
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`deck_sockets.peer_timeout` must be positive and at most one hour");
  return timeout;
}

}  // namespace

// ------------------------------------------------------------------ the folder

class DeckSocketFolder::Share {
 public:
  Share(DeckSocketFolder& folder, int sockets) : folder_(folder), sockets_(sockets) {
    if (folder_.used_.fetch_add(sockets_) + sockets_ <= folder_.most_) return;
    folder_.used_ -= sockets_;
    throw limit_refusal("deck_sockets", folder_.most_, "too many sockets of decks at once");
  }
  ~Share() { folder_.used_ -= sockets_; }
  Share(const Share&) = delete;
  Share& operator=(const Share&) = delete;

 private:
  DeckSocketFolder& folder_;
  const int sockets_;
};

class DeckSocketFolder::Waiting {
 public:
  explicit Waiting(DeckSocketFolder& folder) : folder_(folder) {
    if (++folder_.waiting_ <= kMostWaitingCreations) return;
    --folder_.waiting_;
    throw limit_refusal("deck_sockets_waiting", kMostWaitingCreations,
                        "other simulations wait for the codes of their decks; try again");
  }
  ~Waiting() { --folder_.waiting_; }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;

 private:
  DeckSocketFolder& folder_;
};

DeckSocketFolder::DeckSocketFolder(const std::string& path, int most,
                                   const std::vector<std::string>& listeners)
    : most_(most) {
  if (path.empty()) return;
  path_ = fs::canonical(path).string();
  for (const std::string& listener : listeners) {
    if (listener.rfind("unix:", 0) != 0) continue;
    if (is_inside(fs::weakly_canonical(listener.substr(5)), path_))
      throw std::runtime_error("--deck-sockets needs a folder of its own: the daemon's socket " +
                               listener.substr(5) + " is inside");
  }
}

// Unix sockets inside the folder, no links on the way out of it, no files.
DeckChannel DeckSocketFolder::allowed(const DeckChannel& channel) const {
  const auto refuse_it = [&](const std::string& why) { refuse(channel.card + ": " + why); };
  if (channel.address.kind == Kind::files)
    refuse_it("the server exchanges no files with codes, Unix sockets only");
  if (channel.address.kind != Kind::local)
    refuse_it("the server opens Unix sockets only, not " + mbdyn::text_of(channel.address));
  if (!channel.echo.empty()) refuse_it("the server writes no `echo` file");
  const fs::path given(channel.address.path);
  const bool climbs = std::find(given.begin(), given.end(), "..") != given.end();
  const fs::path path = fs::path(path_) / given;  // an absolute one stays
  std::error_code error;
  const fs::path parent = fs::canonical(path.parent_path(), error);
  if (climbs || error || !is_inside(parent, path_) || !given.has_filename())
    refuse_it("\"" + channel.address.path +
              "\" is not inside the server's folder of --deck-sockets");
  DeckChannel copy = channel;
  copy.address.path = (parent / given.filename()).string();
  if (is_symbolic_link(copy.address.path))
    refuse_it("\"" + channel.address.path + "\" is a symbolic link");
  return copy;
}

std::string DeckSocketFolder::without_path(std::string text) const {
  const std::string prefix = path_ + "/";
  for (std::size_t at; (at = text.find(prefix)) != std::string::npos;)
    text.erase(at, prefix.size());
  return utf8(text);
}

std::unique_ptr<DeckSockets> DeckSocketFolder::open(Simulation& simulation,
                                                    const v1::DeckSocketOptions& options,
                                                    const CancelToken& token) {
  if (path_.empty())
    refuse("the server opens no sockets for decks: it was started without --deck-sockets");
  mbdyn::Patience patience{.time = timeout_of(options), .farewell = kFarewell};
  std::vector<DeckChannel> channels;
  for (const DeckChannel* channel : deck_channels(simulation.model()))
    channels.push_back(allowed(*channel));
  if (channels.empty())
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`deck_sockets`: the deck names no socket");
  const Waiting waiting(*this);
  return std::unique_ptr<DeckSockets>(new DeckSockets(
      *this, simulation, channels, std::move(patience), options.padded_labels(), token));
}

// ------------------------------------------------------------------ those of one simulation

DeckSockets::DeckSockets(DeckSocketFolder& folder, Simulation& simulation,
                         const std::vector<DeckChannel>& channels, mbdyn::Patience patience,
                         bool pads_labels, const CancelToken& token)
    : folder_(folder),
      simulation_(simulation),
      share_(std::make_unique<DeckSocketFolder::Share>(folder, static_cast<int>(channels.size()))) {
  patience.cancelled = [this] {
    const CancelToken* waiting = token_.load();
    return waiting && waiting->cancelled();
  };
  patience.warn = [this](const std::string& text) {
    spdlog::warn("sockets of a deck: {}", folder_.without_path(text));
  };
  std::vector<const DeckChannel*> all;
  for (const DeckChannel& channel : channels) all.push_back(&channel);
  try {
    guarded(token, [&] {
      channels_ = std::make_unique<mbdyn::Channels>(all, simulation, patience, pads_labels);
    });
  } catch (const PeerLost& lost) {
    throw Refusal(token.cancelled() ? v1::REASON_CANCELLED : v1::REASON_PEER_LOST, lost.text);
  }
}

DeckSockets::~DeckSockets() = default;

std::set<std::string> DeckSockets::ports(const Model& model) {
  std::set<std::string> names;
  for (const DeckChannel* channel : deck_channels(model)) names.insert(channel->port);
  return names;
}

/// Lets the work wait as long as the call wants it to. What goes wrong once is told ever after.
template <class Work>
void DeckSockets::guarded(const CancelToken& token, Work&& work) {
  check();
  const auto start = mbdyn::Clock::now();
  token_ = &token;
  try {
    work();
  } catch (const mbdyn::ChannelLost& lost) {
    lost_ = token.cancelled()
                ? "the call was cancelled while a code was asked, and codes cannot be asked again"
                : folder_.without_path(lost.what());
  }
  token_ = nullptr;
  waited_ += std::chrono::duration<double>(mbdyn::Clock::now() - start).count();
  check();
}

void DeckSockets::check() const {
  if (!lost_.empty()) throw PeerLost{lost_};
}

Status DeckSockets::start(const CancelToken& token) {
  const DeckSocketFolder::Waiting waiting(folder_);
  Status status = ok();
  try {
    guarded(token, [&] { status = channels_->start(&token); });
  } catch (const PeerLost& lost) {
    throw Refusal(token.cancelled() ? v1::REASON_CANCELLED : v1::REASON_PEER_LOST, lost.text);
  }
  return status;
}

void DeckSockets::begin(const CancelToken& token) {
  check();
  if (const auto name = channels_->wants_end())
    lost_ = folder_.without_path(*name) + ": the code has ended the run";
  check();
  if (std::exchange(begun_for_, simulation_.step_number()) == simulation_.step_number())
    return attempt_failed();
  guarded(token, [&] { channels_->step_begins(); });
}

bool DeckSockets::exchange(int iteration, const CancelToken& token) {
  bool settled = true;
  guarded(token, [&] { settled = channels_->exchange(iteration); });
  return settled;
}

void DeckSockets::accepted(const CancelToken& token) {
  try {
    guarded(token, [&] { channels_->converged(); });
  } catch (const PeerLost&) {  // remembered
  }
}

void DeckSockets::end() {
  lost_ = "the simulation was deleted";
  channels_.reset();
  share_.reset();
}

}  // namespace mbcosim::server
