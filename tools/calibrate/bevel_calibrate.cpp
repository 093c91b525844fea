// SPDX-License-Identifier: MIT
// bevel-calibrate: cameras from pictures of a board, how late they are from an insertion.
#include <iostream>

#include <bevel/analysis/calibrate/calibrate_tool.hpp>
#include <bevel/cli/command_line.hpp>

int main(int argc, char** argv) {
  bevel::analysis::CalibrateOptions o;
  bevel::cli::CommandLine command_line(
      "bevel-calibrate",
      "Lenses, poses and walls of one or two cameras from pictures of a board: a YAML and a page. Or how late their\n"
      "stamps are, from the log of an insertion that stops and goes.");
  command_line.option("--board", o.print_board, "draw the board into this file (.svg in true size, or .png) and stop")
      .choice("--pattern", o.pattern, "of the board: charuco (default) or chessboard", {"charuco", "chessboard"})
      .option("--columns", o.board.columns, "squares across", 4, 60)
      .option("--rows", o.board.rows, "squares down", 4, 60)
      .option("--square-mm", o.board.square_mm, "side of a square as measured on the print", 0.2, 500)
      .option("--marker-mm", o.board.marker_mm, "side of a ChArUco marker", 0.1, 500)
      .paths("--air", o.air, "folder of pictures in air, one per camera; one name is one moment")
      .paths("--immersed", o.immersed, "the same of the board in the gel or water, behind its wall")
      .option("--index", o.fit.index, "refractive index behind the wall: water 1.333, gelatin 1.335 to 1.35", 1.0, 2.5)
      .option("--gel-index", o.gel_index, "of the gel that takes the water's place after the pictures; 0: the same", 0,
              2.5)
      .flag("--fit-index", o.fit.fit_index, "fit the index too")
      .option("--pane-mm", o.fit.pane.thickness_mm, "thickness of the wall's pane", 0, 100)
      .option("--pane-index", o.fit.pane.index, "its index: glass 1.52, acrylic 1.49", 1.0, 2.5)
      .flag("--k3", o.fit.fit_k3, "fit the third radial term: wide lenses only")
      .paths("--fiducial", o.fiducial, "picture of the board at its known place in {A}, one per camera")
      .flag("--fiducial-immersed", o.fiducial_immersed, "the fiducial is behind the wall")
      .option("--fiducial-x", o.fiducial_x, "axis of {A} along the board's x, left to right as printed")
      .option("--fiducial-y", o.fiducial_y, "axis of {A} along the board's y, top to bottom")
      .numbers("--fiducial-origin-mm", o.fiducial_origin_mm, "x,y,z in {A} of the first square's outer corner", 3)
      .option("--calibration", o.calibration, "a YAML whose frame {A} is still to be found")
      .option("--insertion", o.insertion, "log of a straight insertion recorded with it: gives the frame")
      .option("--roll-deg", o.roll_deg, "with --insertion: x of {A} is turned by this from where camera one looks",
              -180, 180)
      .option("--latency", o.latency, "log of an insertion that stops and goes: how late the stamps of its cameras are")
      .option("-m,--model", o.model, "with --latency: model file (TOML) of its needle")
      .numbers("--numbers", o.numbers, "of the cameras, in the order of the folders", -1)
      .option("-o,--out", o.out_folder, "folder for cameras.yaml, report.html and figures.json")
      .reads_recordings()
      .check([&o]() -> std::string {
        const bool fits = !o.air.empty(), moves = !o.insertion.empty(), late = !o.latency.empty();
        if (static_cast<int>(fits) + static_cast<int>(moves) + static_cast<int>(late) +
                static_cast<int>(!o.print_board.empty()) !=
            1)
          return "one of --air, --insertion, --latency, --board is needed, and only one";
        if (moves && o.calibration.empty()) return "--insertion needs --calibration, the YAML it was recorded with";
        if (late == o.model.empty())
          return late ? "--latency needs --model, the needle of that insertion" : "--model is for --latency only";
        return "";
      });
  command_line.example("bevel-calibrate --columns 8 --rows 6 --square-mm 9 --air air0/ air1/ --out calibration");
  return command_line.run(argc, argv, [&] { return bevel::analysis::run(o, std::cout, std::cerr); });
}
