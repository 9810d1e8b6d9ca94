// Puts the table of limits of the server's flags into a page, between two lines that hold its place:
//   write_limits PAGE           writes it
//   write_limits PAGE --check   fails where the page has another
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>

#include "server/flags.h"

namespace {

constexpr char kBegin[] =
    "<!-- The table of limits is made by build/release/bin/write_limits server/flags.md. -->\n";
constexpr char kEnd[] = "<!-- Its end. -->\n";

int fail(const std::string& why) {
  std::fprintf(stderr, "write_limits: %s\n", why.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  const bool is_check = argc == 3 && std::strcmp(argv[2], "--check") == 0;
  if (argc != 2 && !is_check) return fail("write_limits PAGE [--check]");
  std::ifstream file(argv[1]);
  const std::string page{std::istreambuf_iterator<char>(file), {}};
  const std::size_t begin = page.find(kBegin), end = page.find(kEnd);
  if (begin == std::string::npos || end == std::string::npos)
    return fail(std::string(argv[1]) + " has no place for it");
  const std::string made =
      page.substr(0, begin + std::strlen(kBegin)) + lpdeform::table_of_limits() + page.substr(end);
  if (made == page) return 0;
  if (is_check) return fail(std::string("the flags have changed: run write_limits ") + argv[1]);
  std::ofstream(argv[1]) << made;
  return 0;
}
