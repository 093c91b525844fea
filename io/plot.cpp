#include "io/plot.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>  // mkstemp
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <stdexcept>

#include "io/config.hpp"

namespace bevel::io {
namespace {

// Muted, told apart by people with colour blindness (after Okabe and Ito), dark enough on white.
constexpr std::array<const char*, 7> kPalette{"#1f6fb2", "#d1622b", "#2a8c6b", "#8a5aa8",
                                              "#b8912a", "#4d4d4d", "#b3446c"};

std::string colour_of(const Series& series, std::size_t place) {
  const std::size_t index = series.colour < 0 ? place : static_cast<std::size_t>(series.colour);
  return kPalette.at(index % kPalette.size());
}

// A gnuplot string. Single quotes: nothing inside is special but the quote itself.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'') out += '\'';
    out += (c == '\n' || c == '\r') ? ' ' : c;
  }
  return out + "'";
}

void check(const Plot& plot) {
  bool something = false;
  for (const auto& series : plot.series) {
    const bool is_band = series.kind == Series::Kind::band;
    if (series.x.size() != series.y.size() || (is_band && series.x.size() != series.y_high.size())) {
      throw std::invalid_argument("plot \"" + plot.title + "\", series \"" + series.label + "\": " +
                                  std::to_string(series.x.size()) + " x for " + std::to_string(series.y.size()) + " y");
    }
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      something = something || (std::isfinite(series.x[i]) && std::isfinite(series.y[i]));
    }
  }
  if (!something) throw std::invalid_argument("plot \"" + plot.title + "\": nothing finite to show");
}

std::string range_command(const char* axis, const std::optional<std::pair<double, double>>& range) {
  if (!range) return "";
  return std::string("set ") + axis + "range [" + format_number(range->first) + ":" + format_number(range->second) +
         "]\n";
}

std::string legend_command(Plot::Legend legend) {
  const std::string style = " opaque samplen 2 spacing 1.15 width -1 textcolor rgb '#333333'\n";
  switch (legend) {
    case Plot::Legend::top_left:
      return "set key top left Left reverse" + style;
    case Plot::Legend::top_right:
      return "set key top right Left reverse" + style;
    case Plot::Legend::bottom_left:
      return "set key bottom left Left reverse" + style;
    case Plot::Legend::bottom_right:
      return "set key bottom right Left reverse" + style;
    case Plot::Legend::below:
      return "set key below horizontal maxrows 1 Left reverse samplen 2 width 1 textcolor rgb '#333333'\n";
    case Plot::Legend::none:
      break;
  }
  return "unset key\n";
}

std::string data_block(const Series& series, std::size_t place) {
  std::string text("$d");
  text.append(std::to_string(place)).append(" << EOD\n");
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    text += format_number(series.x[i]) + " " + format_number(series.y[i]);
    if (series.kind == Series::Kind::band) text.append(" ").append(format_number(series.y_high[i]));
    text += '\n';
  }
  return text + "EOD\n";
}

std::string plot_clause(const Series& series, std::size_t place) {
  const std::string colour = " lc rgb '" + colour_of(series, place) + "'";
  std::string text = std::string("$d").append(std::to_string(place));
  switch (series.kind) {
    case Series::Kind::line:
      text += " using 1:2 with lines lw 1.8" + colour;
      break;
    case Series::Kind::dashed:
      text += " using 1:2 with lines lw 1.6 dt (7,5)" + colour;
      break;
    case Series::Kind::points:
      text += " using 1:2 with points pt 7 ps 0.35" + colour;
      break;
    case Series::Kind::step:
      text += " using 1:2 with steps lw 1.6" + colour;
      break;
    case Series::Kind::band:
      text += " using 1:2:3 with filledcurves fs transparent solid 0.18 noborder" + colour;
      break;
  }
  return text + (series.label.empty() ? " notitle" : " title " + quoted(series.label));
}

std::string reference_commands(const std::vector<ReferenceLine>& references) {
  std::string text;
  for (const auto& line : references) {
    const std::string at = format_number(line.at);
    const bool horizontal = line.axis == ReferenceLine::Axis::horizontal;
    text += horizontal ? "set arrow from graph 0, first " + at + " to graph 1, first " + at
                       : "set arrow from first " + at + ", graph 0 to first " + at + ", graph 1";
    text += " nohead lw 1 dt (3,3) lc rgb '#666666' back\n";
    if (line.label.empty()) continue;
    text += "set label " + quoted(line.label) + " at " +
            (horizontal ? "graph 0.99, first " + at + " right offset 0,0.5"
                        : "first " + at + ", graph 0.97 left offset 0.5,0") +
            " textcolor rgb '#555555' font ',11'\n";
  }
  return text;
}

// Ids must be unique in a page with several plots, and gnuplot uses the same ones in each.
std::string with_unique_ids(std::string svg) {
  const std::string number = std::to_string(std::hash<std::string>{}(svg) % 1000000007U);
  const std::string prefix = std::string("p").append(number).append("-");
  for (const std::string mark : {"id='", "id=\"", "href='#", "href=\"#", "url(#"}) {
    for (std::size_t at = svg.find(mark); at != std::string::npos; at = svg.find(mark, at + mark.size())) {
      svg.insert(at + mark.size(), prefix);
    }
  }
  return svg;
}

// Browsers show an SVG title when the pointer rests on the part; gnuplot's are its own names for the series.
std::string without_titles(std::string svg) {
  const std::string open = "<title>";
  const std::string close = "</title>";
  for (std::size_t at = svg.find(open); at != std::string::npos; at = svg.find(open, at)) {
    svg.erase(at, svg.find(close, at) + close.size() - at);
  }
  return svg;
}

class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text) {
    std::string pattern = (std::filesystem::temp_directory_path() / "bevel-plot-XXXXXX").string();
    const int file = mkstemp(pattern.data());
    if (file < 0) throw std::runtime_error(pattern + ": cannot be made");
    ::close(file);
    path_ = pattern;
    std::ofstream(path_) << text;
  }
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::string& path() const { return path_; }
  std::string text() const {
    std::ifstream file(path_);
    return {std::istreambuf_iterator<char>(file), {}};
  }

 private:
  std::string path_;
};

}  // namespace

std::string gnuplot_script(const Plot& plot) {
  check(plot);
  std::string text = "set terminal svg noenhanced rounded size " + std::to_string(plot.width_px) + "," +
                     std::to_string(plot.height_px) + " dynamic font 'Helvetica,Arial,sans-serif,12'\n";
  text += "set encoding utf8\n";
  if (!plot.title.empty()) text += "set title " + quoted(plot.title) + " textcolor rgb '#222222' font ',14'\n";
  text += "set xlabel " + quoted(plot.x_label) + " textcolor rgb '#333333'\n";
  text += "set ylabel " + quoted(plot.y_label) + " textcolor rgb '#333333'\n";
  text += "set border 3 lw 0.8 lc rgb '#888888'\nset tics nomirror out scale 0.5 textcolor rgb '#444444'\n";
  text += "set grid xtics ytics back lw 0.6 lc rgb '#e4e4e4'\n";
  text += legend_command(plot.legend);
  if (plot.log_x) text += "set logscale x\nset format x '%g'\n";
  if (plot.log_y) text += "set logscale y\nset format y '%g'\n";
  if (plot.equal_aspect) text += "set size ratio -1\n";
  text += range_command("x", plot.x_range) + range_command("y", plot.y_range);
  text += reference_commands(plot.references);
  std::string clauses;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    if (plot.series[i].x.empty()) continue;
    text += data_block(plot.series[i], i);
    clauses += (clauses.empty() ? "plot " : ", \\\n  ") + plot_clause(plot.series[i], i);
  }
  return text + clauses + "\n";
}

std::string render_svg(const Plot& plot) {
  const TemporaryFile script(gnuplot_script(plot));
  const TemporaryFile errors("");  // apart from the drawing: a warning in its middle would spoil it
  const std::string command = "gnuplot '" + script.path() + "' 2>'" + errors.path() + "'";
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  if (!pipe) throw std::runtime_error("gnuplot cannot be started");
  std::string output;
  std::array<char, 16384> buffer{};
  while (const std::size_t size = std::fread(buffer.data(), 1, buffer.size(), pipe.get())) {
    output.append(buffer.data(), size);
  }
  const int status = ::pclose(pipe.release());
  const std::size_t start = output.find("<svg");
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || start == std::string::npos) {
    throw std::runtime_error("gnuplot failed on plot \"" + plot.title + "\": " + errors.text().substr(0, 500));
  }
  return with_unique_ids(without_titles(output.substr(start)));
}

Plot& Plot::line(std::string label, std::vector<double> x, std::vector<double> y, int colour) {
  series.push_back({Series::Kind::line, std::move(label), std::move(x), std::move(y), {}, colour});
  return *this;
}
Plot& Plot::dashed(std::string label, std::vector<double> x, std::vector<double> y, int colour) {
  series.push_back({Series::Kind::dashed, std::move(label), std::move(x), std::move(y), {}, colour});
  return *this;
}
Plot& Plot::points(std::string label, std::vector<double> x, std::vector<double> y, int colour) {
  series.push_back({Series::Kind::points, std::move(label), std::move(x), std::move(y), {}, colour});
  return *this;
}
Plot& Plot::step(std::string label, std::vector<double> x, std::vector<double> y, int colour) {
  series.push_back({Series::Kind::step, std::move(label), std::move(x), std::move(y), {}, colour});
  return *this;
}
Plot& Plot::band(std::string label, std::vector<double> x, std::vector<double> low, std::vector<double> high,
                 int colour) {
  series.push_back({Series::Kind::band, std::move(label), std::move(x), std::move(low), std::move(high), colour});
  return *this;
}

}  // namespace bevel::io
