// The packets of mmt's plugs (docs/plugs.md) in C++17, without dependencies: POSIX sockets only.
//
// A driver of a device includes this and sends Reading packets; a robot or a simulator sends Answer packets. See hand.cpp and plant.cpp.

#pragma once

#include <arpa/inet.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace mmt {

enum class Kind : std::uint8_t { reading = 1, force = 2, tool = 3, answer = 4 };

constexpr std::size_t head_bytes = 40;

inline std::uint64_t now_ns() {
  auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

// A number as it stands in a packet: little endian, whatever this machine is.
template <typename T>
void put(unsigned char *place, T value) {
  using Bits = std::conditional_t<sizeof(T) == 8, std::uint64_t, std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint16_t>>;
  Bits bits;
  std::memcpy(&bits, &value, sizeof bits);
  for (std::size_t n = 0; n < sizeof bits; ++n) place[n] = static_cast<unsigned char>(bits >> (8 * n));
}

template <typename T>
T get(const unsigned char *place) {
  using Bits = std::conditional_t<sizeof(T) == 8, std::uint64_t, std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint16_t>>;
  Bits bits = 0;
  for (std::size_t n = 0; n < sizeof bits; ++n) bits |= static_cast<Bits>(place[n]) << (8 * n);
  T value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

// The address that a word of a command line gives, from a line of standard input where it is "-": it holds a token, which other
// users would see on a command line.
inline std::string address_of(const std::string &word) {
  if (word != "-") return word;
  if (isatty(STDIN_FILENO)) std::cerr << "the address, as mmt printed it:" << std::endl;
  std::string line;
  std::getline(std::cin, line);
  while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back()))) line.pop_back();
  return line;
}

// A packet of the other side: flags, number, the periods since the one before (0: it came late or twice, and the rest is still that
// of the newest), and the numbers.
template <typename Number, std::size_t N>
struct Packet {
  std::uint16_t flags = 0;
  std::uint32_t sequence = 0, periods = 0;
  std::array<Number, N> numbers{};
};

// One end of a plug whose packets have N numbers of this type.
template <typename Number, std::size_t N, Kind sends, Kind takes>
class Plug {
 public:
  using Taken = Packet<Number, N>;
  static constexpr std::size_t bytes = head_bytes + N * sizeof(Number);

  // `address`: udp://HOST:PORT?token=…, as mmt printed it. The text of an error does not show it: it holds the token.
  explicit Plug(const std::string &address) {
    const auto host = address.find("://"), query = address.find("?token=");
    const auto port = address.rfind(':', query);
    if (host == std::string::npos || query == std::string::npos || port <= host || address.size() != query + 39 ||
        address.find_first_not_of("0123456789abcdefABCDEF", query + 7) != std::string::npos)
      throw std::runtime_error("this is no address of a plug: give udp://HOST:PORT?token=… with 32 hexadecimal digits, as mmt printed it");
    for (std::size_t n = 0; n < token_.size(); ++n)
      token_[n] = static_cast<unsigned char>(std::stoi(address.substr(query + 7 + 2 * n, 2), nullptr, 16));
    addrinfo hints{}, *found = nullptr;
    hints.ai_socktype = SOCK_DGRAM;
    auto name = address.substr(host + 3, port - host - 3);
    if (!name.empty() && name.front() == '[') name = name.substr(1, name.size() - 2);
    if (getaddrinfo(name.c_str(), address.substr(port + 1, query - port - 1).c_str(), &hints, &found) != 0)
      throw std::runtime_error("nobody knows the host of this address: give it as mmt printed it");
    socket_ = socket(found->ai_family, found->ai_socktype, 0);
    const bool connected = socket_ >= 0 && connect(socket_, found->ai_addr, found->ai_addrlen) == 0;
    freeaddrinfo(found);
    if (!connected) throw std::runtime_error("this host has no socket for the plug");
  }
  ~Plug() { close(socket_); }
  Plug(const Plug &) = delete;
  Plug &operator=(const Plug &) = delete;

  void send(std::uint16_t flags, const std::array<Number, N> &numbers) {
    unsigned char packet[bytes] = {'M', 'M', 'T', 'L', 1, static_cast<unsigned char>(sends)};
    put(packet + 6, flags);
    // it goes round, and 0 is none
    sequence_ = sequence_ == UINT32_MAX ? 1 : sequence_ + 1;
    put(packet + 8, sequence_);
    put(packet + 12, newest_);
    put(packet + 16, now_ns());
    std::memcpy(packet + 24, token_.data(), token_.size());
    for (std::size_t n = 0; n < N; ++n) put(packet + head_bytes + n * sizeof(Number), numbers[n]);
    // nobody there (yet): the silence shows it
    (void)::send(socket_, packet, bytes, MSG_DONTWAIT);
  }

  // The newest packet of the other side; waits for one at most so long.
  std::optional<Taken> receive(int wait_ms) {
    std::optional<Taken> newest;
    pollfd ready{socket_, POLLIN, 0};
    const auto until = now_ns() + static_cast<std::uint64_t>(wait_ms) * 1'000'000;
    const auto left_ms = [&] {
      const auto now = now_ns();
      return newest || now >= until ? 0 : static_cast<int>((until - now + 999'999) / 1'000'000);
    };
    while (poll(&ready, 1, left_ms()) > 0) {
      unsigned char packet[256];
      const auto length = recv(socket_, packet, sizeof packet, MSG_DONTWAIT);
      // nobody there (any more): whoever comes is waited for
      if (length < 0 && (errno == ECONNREFUSED || errno == EAGAIN)) continue;
      if (length < 0) break;
      const unsigned char start[6] = {'M', 'M', 'T', 'L', 1, static_cast<unsigned char>(takes)};
      if (length != static_cast<ssize_t>(bytes) || std::memcmp(packet, start, sizeof start) != 0 ||
          std::memcmp(packet + 24, token_.data(), token_.size()) != 0)
        continue;
      // it goes round: less than half of all numbers ahead is newer
      const auto sequence = get<std::uint32_t>(packet + 8);
      const std::uint32_t ahead = newest_ == 0 ? 1 : sequence - newest_;
      const bool is_newer = ahead != 0 && ahead <= UINT32_MAX / 2;
      if (is_newer) {
        newest_ = taken_.sequence = sequence;
        taken_.flags = get<std::uint16_t>(packet + 6);
        for (std::size_t n = 0; n < N; ++n) taken_.numbers[n] = get<Number>(packet + head_bytes + n * sizeof(Number));
      }
      const std::uint32_t periods = newest ? newest->periods : 0;
      newest = taken_;
      // sent again, or late: no period more
      newest->periods = periods + (is_newer ? ahead : 0);
    }
    return newest;
  }

  std::uint32_t sent() const { return sequence_; }

 private:
  int socket_ = -1;
  std::uint32_t sequence_ = 0, newest_ = 0;
  std::array<unsigned char, 16> token_{};
  Taken taken_;
};

// The plug at the address that a word of a command line gives; the program ends with 2, and why, where there is none.
template <typename Which>
Which plugged_in(const std::string &word) {
  try {
    return Which(address_of(word));
  } catch (const std::exception &error) {
    std::cerr << error.what() << std::endl;
    std::exit(2);
  }
}

using DevicePlug = Plug<float, 6, Kind::reading, Kind::force>;
using PlantPlug = Plug<double, 10, Kind::answer, Kind::tool>;

}  // namespace mmt
