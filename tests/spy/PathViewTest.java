// SPDX-License-Identifier: MIT
package bevel.spy;

import bevel.needle_state_t;
import bevel.steering_target_t;
import bevel.tip_measurement_t;
import java.awt.Color;
import java.awt.image.BufferedImage;
import java.io.File;
import javax.imageio.ImageIO;
import javax.swing.Action;
import lcm.lcm.LCMDataInputStream;
import lcm.lcm.LCMDataOutputStream;
import lcm.lcm.LCMEncodable;
import lcm.lcm.LCMSubscriber;

/** The plug-in without a display: what lcm-spy asks of it, and where the picture has which colour. */
final class PathViewTest {
  private static final int WIDTH = 560, HEIGHT = 420;
  private final PathView view = new PathView();
  private final LCMSubscriber subscriber = PathPlugin.subscriberOf(view);

  private static void check(boolean holds, String what) {
    if (!holds) {
      System.out.println("FAILED: " + what);
      System.exit(1);
    }
  }

  private static void near(double is, double should, double by, String what) {
    check(Math.abs(is - should) <= by, what + ": is " + is + ", should be " + should + " within " + by);
  }

  private void send(String channel, LCMEncodable message) throws Exception {
    LCMDataOutputStream bytes = new LCMDataOutputStream();
    message.encode(bytes);
    subscriber.messageReceived(null, channel, new LCMDataInputStream(bytes.toByteArray()));
  }

  private void estimate(long utime, double x, double y, double z) throws Exception {
    needle_state_t state = new needle_state_t();
    state.utime = utime;
    state.position_mm = new double[] {x, y, z};
    send("NEEDLE_STATE", state);
  }

  private void target(int request, double x, double y, double z) throws Exception {
    steering_target_t word = new steering_target_t();
    word.request = request;
    word.position_mm = new double[] {x, y, z};
    word.tolerance_mm = 0;
    send("STEERING_TARGET", word);
  }

  private BufferedImage painted() {
    BufferedImage image = new BufferedImage(WIDTH, HEIGHT, BufferedImage.TYPE_INT_RGB);
    view.setSize(WIDTH, HEIGHT);
    view.paint(image.getGraphics());
    return image;
  }

  /** Count, mean column and row, first and last column of a colour in the upper (0) or the lower half (1). */
  private static double[] spot(BufferedImage image, Color color, int half) {
    double count = 0, column = 0, row = 0, first = WIDTH, last = -1;
    for (int y = half * HEIGHT / 2; y < (half + 1) * HEIGHT / 2; ++y) {
      for (int x = 0; x < WIDTH; ++x) {
        if ((image.getRGB(x, y) & 0xffffff) == (color.getRGB() & 0xffffff)) {
          ++count;
          column += x;
          row += y;
          first = Math.min(first, x);
          last = Math.max(last, x);
        }
      }
    }
    return new double[] {count, column / count, row / count, first, last};
  }

  private void run(String picture) throws Exception {
    PathPlugin plugin = new PathPlugin();
    Action action = plugin.getAction(null, null);
    check("Path and target".equals(action.getValue(Action.NAME)), "the menu's name");
    check(plugin.canHandle(needle_state_t.LCM_FINGERPRINT) && plugin.canHandle(steering_target_t.LCM_FINGERPRINT)
        && plugin.canHandle(tip_measurement_t.LCM_FINGERPRINT) && !plugin.canHandle(1), "what it can handle");
    check(!new PathPlugin().canHandle(needle_state_t.LCM_FINGERPRINT), "lcm-spy's second find of the same class is silent");
    check(spot(painted(), PathView.ESTIMATE, 0)[0] == 0, "no path before a message");

    // A straight path of 100 mm gives the scale; the target half way, 10 mm up in x and 5 mm down in y.
    for (int i = 0; i <= 100; ++i) {
      estimate(1000 + i, 0, 0, i);
    }
    target(2, 50, 50, 50);  // start: carries none
    check(spot(painted(), PathView.TARGET, 0)[0] == 0, "no target before one is set");
    target(1, 10, -5, 50);
    BufferedImage image = painted();
    for (int half = 0; half < 2; ++half) {
      double[] path = spot(image, PathView.ESTIMATE, half), mark = spot(image, PathView.TARGET, half);
      double pxPerMm = (path[4] - path[3]) / 100;
      check(path[0] > 300 && pxPerMm > 3, "a path as wide as the picture, half " + half);
      near(mark[1], (path[3] + path[4]) / 2, 2, "target's column, half " + half);
      near(mark[2], path[2] - (half == 0 ? 10 : -5) * pxPerMm, 2, "target's row, half " + half);
    }
    near(spot(image, PathView.ESTIMATE, 1)[3], spot(image, PathView.ESTIMATE, 0)[3], 1, "both halves begin at one column");
    check(view.sentence().contains("51.23 mm away"), view.sentence());  // sqrt(10^2 + 5^2 + 50^2)

    // A camera that sees y and z leaves its dots in the lower half alone, and where it saw nothing, none.
    tip_measurement_t tip = new tip_measurement_t();
    tip.position_mm = new double[] {0, 8, 75};
    tip.information_per_mm2[4] = tip.information_per_mm2[8] = 40;
    send("TIP_MEASUREMENT", tip);
    tip.position_mm = new double[] {0, Double.NaN, 75};
    send("TIP_MEASUREMENT", tip);
    image = painted();
    check(spot(image, PathView.MEASURED, 0)[0] == 0 && spot(image, PathView.MEASURED, 1)[0] > 0, "a camera's dot");
    if (picture != null) {
      ImageIO.write(image, "png", new File(picture));
    }

    // What cannot be decoded, is not finite, or is of a reset does no harm.
    subscriber.messageReceived(null, "NEEDLE_STATE", new LCMDataInputStream(new byte[] {1, 2, 3}));
    estimate(2000, Double.NaN, 0, 1);
    target(1, 0, Double.POSITIVE_INFINITY, 0);
    check(spot(painted(), PathView.TARGET, 0)[0] > 0, "the target stays");
    estimate(500, 0, 0, 3);  // time goes back: a log from its beginning
    double[] anew = spot(painted(), PathView.ESTIMATE, 0);
    check(anew[4] - anew[3] < 10, "a new path");
    for (int i = 0; i < 40000; ++i) {
      estimate(3000 + i, 0, 0, i * 1e-3);
    }
    double[] longest = spot(painted(), PathView.ESTIMATE, 0);
    check(longest[0] > 200, "a long path is thinned, not lost");
    System.out.println("ok");
  }

  public static void main(String[] arguments) throws Exception {
    new PathViewTest().run(arguments.length > 0 ? arguments[0] : null);
  }
}
