#include "doppel/server/http_answers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "doppel/server/foxglove_protocol.h"

namespace doppel {
namespace {

std::string escape(std::string_view text, bool json) {
  std::string out;
  for (const char c : text) {
    if (json) {
      if (c == '"' || c == '\\') out += '\\';
      if (static_cast<unsigned char>(c) >= 0x20) out += c;
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '&') {
      out += "&amp;";
    } else {
      out += c;
    }
  }
  return out;
}

constexpr std::string_view kPageTop = R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>doppel</title><style>
:root { color-scheme: light dark; --ink: #1d2430; --soft: #5b6675; --line: #dfe4ea; --paper: #f7f8fa; --card: #fff; --accent: #0b7285; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e9ee; --soft: #98a2b1; --line: #2a313c; --paper: #12161c; --card: #1a2029; --accent: #4fc3d9; }
}
body { margin: 0; background: var(--paper); color: var(--ink); font: 16px/1.55 system-ui, sans-serif; }
main { max-width: 44rem; margin: 12vh auto 4rem; padding: 0 1.5rem; }
h1 { margin: 0; font-size: 1.9rem; letter-spacing: -.02em; }
p { color: var(--soft); margin: .4rem 0 1.6rem; }
section { background: var(--card); border: 1px solid var(--line); border-radius: 12px; padding: 1.1rem 1.4rem; margin: 1rem 0; }
h2 { margin: 0 0 .6rem; font-size: .8rem; text-transform: uppercase; letter-spacing: .08em; color: var(--soft); }
code, pre { font: .9rem/1.7 ui-monospace, "DejaVu Sans Mono", monospace; margin: 0; }
.address { color: var(--accent); font-size: 1.1rem; user-select: all; }
pre { overflow-x: auto; } pre i { color: var(--soft); font-style: normal; }
</style></head><body><main>
)";

constexpr std::string_view kPageVerbs = R"(<section><h2>From another shell</h2><pre>
doppel topic list                    <i>what there is to see</i>
doppel topic echo /joint_states
doppel control list_controllers
doppel move "Joint=90deg" --in 2     <i>with a joint's name</i>
doppel tf tree
doppel node list
doppel service list
doppel param list
doppel action list
</pre></section>
</main></body></html>
)";

HttpAnswer front_page(const HttpFacts& facts) {
  std::string body(kPageTop);
  body += fmt::format(
      "<h1>{}</h1>\n<p>A digital twin is running here: {} topics, {:.1f} s of simulated time.</p>\n",
      escape(facts.name, false), facts.topics, facts.sim_time);
  body += fmt::format("<section><h2>Foxglove WebSocket</h2><code class=\"address\">{}</code></section>\n",
                      escape(facts.url, false));
  body += kPageVerbs;
  return {200, "text/html; charset=utf-8", std::move(body)};
}

std::string_view trim(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

}  // namespace

HttpAnswer http_problem(unsigned status, std::string text) {
  return {status, "text/plain; charset=utf-8", std::move(text) + "\n"};
}

HttpAnswer answer_http(std::string_view method, std::string_view target, const HttpFacts& facts) {
  if (method != "GET" && method != "HEAD") return http_problem(405, "only GET is answered here");
  const std::string_view path = target.substr(0, target.find('?'));
  if (path == "/") return front_page(facts);
  if (path == "/health") {
    return {200, "application/json",
            fmt::format("{{\"status\":\"ok\",\"name\":\"{}\",\"url\":\"{}\",\"clients\":{},\"topics\":{},"
                        "\"sim_time\":{:.6f}}}\n",
                        escape(facts.name, true), escape(facts.url, true), facts.clients, facts.topics,
                        facts.sim_time)};
  }
  return http_problem(404, "there is nothing here; / tells what runs");
}

bool is_local_host(std::string_view host) {
  host = trim(host);
  std::string_view name = host, port;
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    if (end == std::string_view::npos) return false;
    name = host.substr(0, end + 1);
    port = host.substr(end + 1);
  } else if (const std::size_t colon = host.find(':'); colon != std::string_view::npos) {
    name = host.substr(0, colon);
    port = host.substr(colon);
  }
  if (!port.empty()) {
    if (port.front() != ':') return false;
    const std::string_view digits = port.substr(1);
    if (!std::ranges::all_of(digits, [](unsigned char c) { return std::isdigit(c) != 0; })) return false;
  }
  std::string lower(name);
  std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return std::tolower(c); });
  return lower == "localhost" || lower == "127.0.0.1" || lower == "[::1]";
}

bool is_local_origin(std::string_view origin) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme)) return is_local_host(origin.substr(scheme.size()));
  }
  return false;
}

std::string_view choose_subprotocol(std::string_view offered) {
  while (true) {
    const std::size_t comma = offered.find(',');
    const std::string_view one = trim(offered.substr(0, comma));
    for (const std::string_view known : {foxglove::kSubprotocol, foxglove::kSdkSubprotocol}) {
      if (one == known) return known;
    }
    if (comma == std::string_view::npos) return "";
    offered.remove_prefix(comma + 1);
  }
}

}  // namespace doppel
