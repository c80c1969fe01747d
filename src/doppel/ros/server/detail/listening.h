#pragma once
// The server's listening socket and its addresses.

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <string>

#include "doppel/ros/server/server.h"

namespace doppel::net {

// Throws InputError if this machine does not have the address, or no port is available.
boost::asio::ip::tcp::acceptor listen(boost::asio::io_context& io, const ServerOptions& options);

// The owner of a port: "the twin of omarm_one (process 12)", or the command that finds it.
std::string port_holder(std::uint16_t port);

// The host that other machines can use: `address`, or, for the wildcard address, the first address of this
// machine that is not loopback. Brackets around IPv6.
std::string reachable_host(const boost::asio::ip::address& address);
// The address under which this machine itself reaches a server that listens on `address`.
std::string own_address(const boost::asio::ip::address& address);

}  // namespace doppel::net
