#include "doppel/ros/server/detail/http_responses.h"

#include <fmt/format.h>

#include "doppel/ros/foxglove/foxglove_protocol.h"
#include "doppel/ros/server/detail/header_text.h"

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
doppel topic list                    <i>all topics</i>
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

// Content-Security-Policy: the page may load only files of this server, and may connect to WebSockets of any
// host, because its address can name another twin. Meshes and images are blobs.
constexpr std::string_view kPagePolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self' ws: wss: blob:; font-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'";
constexpr std::string_view kSmallPagePolicy =
    "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'";

HttpResponse small_page(const ServerSummary& facts) {
  HttpResponse answer;
  answer.content_type = "text/html; charset=utf-8";
  answer.headers.emplace_back("Content-Security-Policy", std::string(kSmallPagePolicy));
  answer.body = kPageTop;
  answer.body += fmt::format(
      "<h1>{}</h1>\n<p>A digital twin is running here, with {} topics. The web page is not built; "
      "<code>./doppel</code> builds it.</p>\n",
      escape(facts.name, false), facts.topics);
  answer.body +=
      fmt::format("<section><h2>Foxglove WebSocket</h2><code class=\"address\">{}</code></section>\n",
                  escape(facts.url, false));
  answer.body += kPageVerbs;
  return answer;
}

HttpResponse health(const ServerSummary& facts) {
  HttpResponse answer;
  answer.content_type = "application/json";
  answer.body = fmt::format(
      "{{\"status\":\"ok\",\"name\":\"{}\",\"url\":\"{}\",\"clients\":{},\"topics\":{}}}"
      "\n",
      escape(facts.name, true), escape(facts.url, true), facts.clients, facts.topics);
  return answer;
}

}  // namespace

bool accepts_gzip(std::string_view accept_encoding) {
  return any_entry(accept_encoding, ',', [](std::string_view coding) {
    const std::size_t semicolon = coding.find(';');
    const std::string_view name = trim_blanks(coding.substr(0, semicolon));
    if (name != "gzip" && name != "*") return false;
    const std::string_view weight =
        semicolon == std::string_view::npos ? "" : trim_blanks(coding.substr(semicolon + 1));
    return weight != "q=0" && weight != "q=0.0" && weight != "q=0.00" && weight != "q=0.000";
  });
}

namespace {

bool matches(std::string_view if_none_match, std::string_view tag) {
  if (if_none_match.empty()) return false;
  return any_entry(if_none_match, ',', [tag](std::string_view known) {
    if (known.starts_with("W/")) known.remove_prefix(2);
    return known == "*" || known == tag;
  });
}

std::string quoted_tag(const ServedFile& file, bool packed) {
  return fmt::format("\"{}{}\"", file.tag, packed ? "-gzip" : "");
}

HttpResponse answer_page_file(const PageFile& file, const HttpRequest& question) {
  HttpResponse answer = file_response({.content_type = file.content_type,
                                       .tag = file.tag,
                                       .bytes = file.bytes,
                                       .gzip = file.gzip,
                                       .owner = nullptr,
                                       .immutable = file.immutable},
                                      question);
  answer.headers.emplace_back("Content-Security-Policy", std::string(kPagePolicy));
  return answer;
}

}  // namespace

bool is_known(const ServedFile& file, const HttpRequest& question) {
  return matches(question.if_none_match, quoted_tag(file, true)) ||
         matches(question.if_none_match, quoted_tag(file, false));
}

HttpResponse file_response(const ServedFile& file, const HttpRequest& question) {
  const bool packed = !file.gzip.empty() && accepts_gzip(question.accept_encoding);
  std::string tag = quoted_tag(file, packed);
  // A file that the client has in compressed form is not compressed again to compare it.
  const bool has_packed = file.gzip.empty() && accepts_gzip(question.accept_encoding) &&
                          matches(question.if_none_match, quoted_tag(file, true));
  if (has_packed) tag = quoted_tag(file, true);
  HttpResponse answer;
  answer.headers = {
      {"ETag", tag},
      {"Vary", "Accept-Encoding"},
      {"Cache-Control", file.immutable ? "public, max-age=31536000, immutable" : "no-cache"},
  };
  if (matches(question.if_none_match, tag)) {
    answer.status = 304;
    return answer;
  }
  answer.content_type = file.content_type;
  answer.file = packed ? file.gzip : file.bytes;
  answer.owner = file.owner;
  if (packed) answer.headers.emplace_back("Content-Encoding", "gzip");
  return answer;
}

HttpResponse http_problem(unsigned status, std::string text) {
  HttpResponse answer;
  answer.status = status;
  answer.content_type = "text/plain; charset=utf-8";
  answer.body = std::move(text) + "\n";
  return answer;
}

HttpResponse http_response_to(const HttpRequest& question, PageFiles& page, const ServerSummary& facts) {
  if (question.method != "GET" && question.method != "HEAD") {
    HttpResponse answer = http_problem(405, "only GET and HEAD are supported");
    answer.headers.emplace_back("Allow", "GET, HEAD");
    return answer;
  }
  const std::string_view path = question.target.substr(0, question.target.find('?'));
  if (const PageFile* file = page.find(path)) return answer_page_file(*file, question);
  if (path == "/") return small_page(facts);
  if (path == "/health") return health(facts);
  return http_problem(404, "not found; the page is at /");
}

std::string_view choose_subprotocol(std::string_view offered) {
  std::string_view chosen;
  any_entry(offered, ',', [&chosen](std::string_view one) {
    for (const std::string_view known : {foxglove::kSubprotocol, foxglove::kSdkSubprotocol}) {
      if (one == known) chosen = known;
    }
    return !chosen.empty();
  });
  return chosen;
}

}  // namespace doppel
