#pragma once
// Where the server listens, and what to call that place.

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <string>

#include "doppel/server/server.h"

namespace doppel::net {

// Throws InputError if there is no such address here, or no port to listen on.
boost::asio::ip::tcp::acceptor listen(boost::asio::io_context& io, const ServerOptions& options);

// "the twin of omarm_one (process 12)", or how to find out.
std::string port_holder(std::uint16_t port);

// The host of an address that others can open: `address`, or for one that stands for all of this machine's
// the first that is not loopback. Brackets around IPv6.
std::string reachable_host(const boost::asio::ip::address& address);
// The address under which this machine itself reaches a server that listens on `address`.
std::string own_address(const boost::asio::ip::address& address);

}  // namespace doppel::net
