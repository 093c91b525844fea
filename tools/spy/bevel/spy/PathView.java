// SPDX-License-Identifier: MIT
package bevel.spy;

import bevel.needle_state_t;
import bevel.steering_target_t;
import bevel.tip_measurement_t;
import java.awt.BasicStroke;
import java.awt.Color;
import java.awt.Dimension;
import java.awt.Graphics;
import java.awt.Graphics2D;
import java.awt.RenderingHints;
import java.awt.geom.Ellipse2D;
import java.awt.geom.Line2D;
import java.awt.geom.Path2D;
import java.util.ArrayList;
import java.util.List;
import java.util.Locale;
import javax.swing.JPanel;

/**
 * The needle's path and its target in {A}, mm: above x over z, below y over z, both axes of both to one scale. z, into the
 * tissue, goes to the right; x and y go up. Messages may come from any thread.
 */
public final class PathView extends JPanel {
  private static final long serialVersionUID = 1;
  static final Color ESTIMATE = new Color(0x1f6fb2);
  static final Color TRUTH = new Color(0x2a8c6b);
  static final Color MEASURED = new Color(0xa08cc8);
  static final Color TARGET = new Color(0xd1762b);
  private static final Color LINES = new Color(0xe4e4e4);
  private static final int MARGIN_PX = 34;
  private static final double LEAST_DEPTH_MM = 20, LEAST_SIDE_MM = 5;
  // As long as 500 s of estimates at 30 Hz; what is longer is thinned.
  private static final int MOST_POINTS = 15000;

  private final List<double[]> estimated = new ArrayList<>(), truth = new ArrayList<>(), measured = new ArrayList<>();
  private double[] target;
  private double toleranceMm;
  private long lastUtime = Long.MIN_VALUE;
  private int resetCount;

  public PathView() {
    setBackground(Color.WHITE);
    setPreferredSize(new Dimension(560, 420));
  }

  /** NEEDLE_STATE. A declared reset, or time that goes back (a log played again), begins a new path. */
  public synchronized void onEstimate(needle_state_t state) {
    if (!finite(state.position_mm)) {
      return;
    }
    if (state.utime < lastUtime || state.reset_count != resetCount) {
      clear();
    }
    lastUtime = state.utime;
    resetCount = state.reset_count;
    add(estimated, state.position_mm);
  }

  /** NEEDLE_TRUTH, of the simulated rig. */
  public synchronized void onTruth(needle_state_t state) {
    if (finite(state.position_mm)) {
      add(truth, state.position_mm);
    }
  }

  /** TIP_MEASUREMENT. A camera sees two axes as a rule: what it does not see is NaN here, and not drawn. */
  public synchronized void onMeasurement(tip_measurement_t tip) {
    double[] seen = new double[3];
    for (int axis = 0; axis < 3; ++axis) {
      seen[axis] = tip.information_per_mm2[4 * axis] > 0 ? tip.position_mm[axis] : Double.NaN;
    }
    if (tip.status == 0) {
      add(measured, seen);
    }
  }

  /** STEERING_TARGET. Requests 1 (set) and 6 (it has moved) carry a target, the others do not. */
  public synchronized void onTarget(steering_target_t word) {
    if ((word.request == 1 || word.request == 6) && finite(word.position_mm)) {
      target = word.position_mm.clone();
      toleranceMm = word.tolerance_mm;
    }
  }

  public synchronized void clear() {
    estimated.clear();
    truth.clear();
    measured.clear();
    lastUtime = Long.MIN_VALUE;
  }

  private static boolean finite(double[] position) {
    return Double.isFinite(position[0]) && Double.isFinite(position[1]) && Double.isFinite(position[2]);
  }

  private static void add(List<double[]> path, double[] position) {
    if (!Double.isFinite(position[2]) || !Double.isFinite(position[0]) && !Double.isFinite(position[1])) {
      return;
    }
    if (path.size() >= MOST_POINTS) {
      for (int i = 1; i < path.size(); ++i) {
        path.remove(i);  // every second one
      }
    }
    path.add(position.clone());
  }

  /** From mm to pixels; one scale for both axes of both halves. */
  private static final class Scale {
    final double left, pxPerMm;
    final double[] middle;

    Scale(int width, int height, double depthMm, double sideMm) {
      left = MARGIN_PX;
      double across = (width - 1.5 * MARGIN_PX) / depthMm;
      double up = (height - 3.0 * MARGIN_PX) / 2 / (2 * sideMm);
      pxPerMm = Math.max(1e-6, Math.min(across, up));
      double half = (height - 3.0 * MARGIN_PX) / 2;
      middle = new double[] {MARGIN_PX + half / 2, 2 * MARGIN_PX + 1.5 * half};
    }

    double x(double zMm) {
      return left + zMm * pxPerMm;
    }

    double y(int half, double sideMm) {
      return middle[half] - sideMm * pxPerMm;
    }
  }

  @Override
  protected synchronized void paintComponent(Graphics graphics) {
    super.paintComponent(graphics);
    Graphics2D g = (Graphics2D) graphics.create();
    g.setRenderingHint(RenderingHints.KEY_ANTIALIASING, RenderingHints.VALUE_ANTIALIAS_ON);
    double depthMm = LEAST_DEPTH_MM, sideMm = LEAST_SIDE_MM;
    List<double[]> all = new ArrayList<>(estimated);
    all.addAll(truth);
    all.addAll(measured);
    if (target != null) {
      all.add(target);
    }
    for (double[] p : all) {
      depthMm = Math.max(depthMm, p[2]);
      for (int half = 0; half < 2; ++half) {
        sideMm = Double.isFinite(p[half]) ? Math.max(sideMm, Math.abs(p[half])) : sideMm;
      }
    }
    Scale scale = new Scale(getWidth(), getHeight(), 1.1 * depthMm, 1.1 * sideMm);
    for (int half = 0; half < 2; ++half) {
      paintHalf(g, scale, half, depthMm, sideMm);
    }
    g.setColor(Color.DARK_GRAY);
    g.drawString(sentence(), MARGIN_PX, getHeight() - 10);
    g.dispose();
  }

  private void paintHalf(Graphics2D g, Scale scale, int half, double depthMm, double sideMm) {
    double step = niceStep(depthMm);
    for (double z = 0; z <= 1.1 * depthMm; z += step) {
      g.setColor(LINES);
      g.draw(new Line2D.Double(scale.x(z), scale.y(half, -sideMm), scale.x(z), scale.y(half, sideMm)));
      g.setColor(Color.GRAY);
      g.drawString(String.format(Locale.ROOT, "%g", z).replaceAll("\\.?0+$", ""), (float) scale.x(z),
          (float) scale.y(half, -sideMm) + 12);
    }
    g.setColor(LINES);
    g.draw(new Line2D.Double(scale.x(0), scale.y(half, 0), scale.x(1.1 * depthMm), scale.y(half, 0)));
    g.setColor(Color.DARK_GRAY);
    g.drawString((half == 0 ? "x" : "y") + " over z, mm", MARGIN_PX, (float) scale.y(half, sideMm) - 6);
    g.setColor(MEASURED);
    for (double[] p : measured) {
      if (Double.isFinite(p[half])) {
        g.fillRect((int) Math.round(scale.x(p[2])) - 1, (int) Math.round(scale.y(half, p[half])) - 1, 2, 2);
      }
    }
    paintPath(g, scale, half, truth, TRUTH);
    paintPath(g, scale, half, estimated, ESTIMATE);
    if (target != null) {
      double x = scale.x(target[2]), y = scale.y(half, target[half]);
      double radius = Math.max(0, toleranceMm) * scale.pxPerMm;
      g.setColor(TARGET);
      g.draw(new Line2D.Double(x - 5, y, x + 5, y));
      g.draw(new Line2D.Double(x, y - 5, x, y + 5));
      g.draw(new Ellipse2D.Double(x - radius, y - radius, 2 * radius, 2 * radius));
    }
  }

  private static void paintPath(Graphics2D g, Scale scale, int half, List<double[]> path, Color color) {
    Path2D line = new Path2D.Double();
    for (double[] p : path) {
      if (line.getCurrentPoint() == null) {
        line.moveTo(scale.x(p[2]), scale.y(half, p[half]));
      }
      line.lineTo(scale.x(p[2]), scale.y(half, p[half]));
    }
    g.setColor(color);
    g.setStroke(new BasicStroke(1.6f));
    g.draw(line);
    g.setStroke(new BasicStroke());
  }

  /** 1, 2 or 5 times a power of ten: about five lines. */
  private static double niceStep(double range) {
    double power = Math.pow(10, Math.floor(Math.log10(range / 5)));
    double share = range / 5 / power;
    return power * (share < 2 ? 1 : share < 5 ? 2 : 5);
  }

  /** What the picture shows, in figures. */
  synchronized String sentence() {
    if (estimated.isEmpty()) {
      return "No NEEDLE_STATE yet";
    }
    double[] tip = estimated.get(estimated.size() - 1);
    String text = String.format(Locale.ROOT, "Tip %.2f, %.2f, %.2f mm", tip[0], tip[1], tip[2]);
    if (target != null) {
      double off = Math.sqrt(Math.pow(target[0] - tip[0], 2) + Math.pow(target[1] - tip[1], 2)
          + Math.pow(target[2] - tip[2], 2));
      text += String.format(Locale.ROOT, "; target %.2f, %.2f, %.2f mm, %.2f mm away", target[0], target[1], target[2], off);
    }
    return text;
  }
}
