/// The memory, and how it gets from the server to the client.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <new>
#include <system_error>
#include <vector>

#include "shared_memory/channel.h"

namespace mbcosim::shm {
namespace {

constexpr char kMagic[8] = {'m', 'b', 'c', 'o', 's', 'i', 'm', '1'};
constexpr std::size_t kPage = 4096;  // headers of both rings
constexpr std::size_t kSegmentBytes = kPage + 2 * kRingBytes;
constexpr std::size_t kLongestPacket = 1 << 16;
constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;
static_assert(2 * sizeof(RingHeader) <= kPage);

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

void* map(int fd) {
  void* base = ::mmap(nullptr, kSegmentBytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  if (base == MAP_FAILED) fail("shared memory");
  return base;
}

std::string packet(const std::string& content) { return std::string(kMagic, 8) + content; }

/// Content of a packet of ours.
bool is_packet(const std::string& bytes, std::string* content) {
  if (bytes.size() < sizeof kMagic || std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0)
    return false;
  *content = bytes.substr(sizeof kMagic);
  return true;
}

bool send_packet(int socket, const std::string& bytes) {
  return ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
         static_cast<ssize_t>(bytes.size());
}

/// Empty: the other side is gone.
std::string receive_packet(int socket) {
  std::vector<char> buffer(kLongestPacket);
  const ssize_t count = ::recv(socket, buffer.data(), buffer.size(), 0);
  return count > 0 ? std::string(buffer.data(), static_cast<std::size_t>(count)) : "";
}

bool read_status(const std::string& bytes, Status* status) {
  std::string content;
  if (!is_packet(bytes, &content) || content.empty()) return false;
  status->code = static_cast<unsigned char>(content[0]);
  status->bytes = content.substr(1);
  return true;
}

}  // namespace

Descriptor::~Descriptor() {
  if (fd_ >= 0) ::close(fd_);
}

void Segment::Unmap::operator()(void* base) const { ::munmap(base, kSegmentBytes); }

Segment::Segment(Descriptor fd, void* base) : fd_(std::move(fd)), base_(base) {}
Segment::~Segment() = default;

Segment Segment::create() {
  Descriptor fd(::memfd_create("mbcosim", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!fd) fail("shared memory");
  if (::ftruncate(fd.get(), kSegmentBytes) != 0) fail("shared memory");
  if (::fcntl(fd.get(), F_ADD_SEALS, kSeals) != 0) fail("shared memory");
  void* base = map(fd.get());
  Segment segment(std::move(fd), base);
  for (const int ring : {0, 1}) new (segment.header(ring)) RingHeader;
  return segment;
}

Segment Segment::open(Descriptor fd) {
  struct stat info {};
  if (::fstat(fd.get(), &info) != 0) fail("shared memory");
  const int seals = ::fcntl(fd.get(), F_GET_SEALS);
  if (info.st_size != static_cast<off_t>(kSegmentBytes) || seals < 0 || (seals & kSeals) != kSeals)
    throw Corrupt("the server's memory has another size or is not sealed");
  void* base = map(fd.get());
  return Segment(std::move(fd), base);
}

RingHeader* Segment::header(int ring) const {
  return reinterpret_cast<RingHeader*>(static_cast<std::byte*>(base_.get()) +
                                       static_cast<std::size_t>(ring) * sizeof(RingHeader));
}

std::byte* Segment::bytes(int ring) const {
  return static_cast<std::byte*>(base_.get()) + kPage + static_cast<std::size_t>(ring) * kRingBytes;
}

std::string rendezvous_path(const std::string& address) {
  constexpr const char* kUnix = "unix:";
  if (address.rfind(kUnix, 0) != 0) return "";
  std::string path = address.substr(std::strlen(kUnix));
  if (path.rfind("//", 0) == 0) path = path.substr(2);
  return path + ".shm";
}

// ------------------------------------------------------------------ over the socket

std::optional<Segment> request_segment(int socket, const Request& request, Status* refusal) {
  if (!send_packet(socket, packet(request.authorization))) fail("shared memory: request");
  std::vector<char> buffer(kLongestPacket);
  iovec part{buffer.data(), buffer.size()};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))];
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;
  const ssize_t count = ::recvmsg(socket, &message, MSG_CMSG_CLOEXEC);
  if (count < 0) fail("shared memory: answer");
  const cmsghdr* header = CMSG_FIRSTHDR(&message);
  if (!header || header->cmsg_type != SCM_RIGHTS) {
    if (read_status({buffer.data(), static_cast<std::size_t>(count)}, refusal)) return std::nullopt;
    throw Corrupt("the server gave no shared memory");
  }
  int fd = -1;
  std::memcpy(&fd, CMSG_DATA(header), sizeof fd);
  return Segment::open(Descriptor(fd));
}

bool read_request(int socket, Request* request) {
  return is_packet(receive_packet(socket), &request->authorization);
}

bool send_segment(int socket, const Segment& segment) {
  char magic[sizeof kMagic];
  std::memcpy(magic, kMagic, sizeof magic);
  iovec part{magic, sizeof magic};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;
  cmsghdr* header = CMSG_FIRSTHDR(&message);
  header->cmsg_level = SOL_SOCKET;
  header->cmsg_type = SCM_RIGHTS;
  header->cmsg_len = CMSG_LEN(sizeof(int));
  const int fd = segment.descriptor();
  std::memcpy(CMSG_DATA(header), &fd, sizeof fd);
  return ::sendmsg(socket, &message, MSG_NOSIGNAL) > 0;
}

void send_status(int socket, const Status& status) {
  send_packet(socket,
              packet(static_cast<char>(status.code) + status.bytes.substr(0, kLongestPacket / 2)));
}

std::optional<Status> receive_status(int socket) {
  Status status;
  if (!read_status(receive_packet(socket), &status)) return std::nullopt;
  return status;
}

}  // namespace mbcosim::shm
