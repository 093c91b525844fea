// SPDX-License-Identifier: MIT
package bevel.spy;

import bevel.needle_state_t;
import bevel.steering_target_t;
import bevel.tip_measurement_t;
import java.awt.event.ActionEvent;
import java.io.IOException;
import java.util.concurrent.atomic.AtomicBoolean;
import javax.swing.AbstractAction;
import javax.swing.Action;
import javax.swing.JDesktopPane;
import javax.swing.JInternalFrame;
import javax.swing.SwingUtilities;
import javax.swing.Timer;
import javax.swing.event.InternalFrameAdapter;
import javax.swing.event.InternalFrameEvent;
import lcm.lcm.LCM;
import lcm.lcm.LCMDataInputStream;
import lcm.lcm.LCMSubscriber;
import lcm.spy.ChannelData;
import lcm.spy.SpyPlugin;

/**
 * A plug-in of lcm-spy: the needle's path and its target, by the menu of a channel of these types. lcm-spy does not hand on
 * its connection, so this one has its own, by LCM_DEFAULT_URL, which tools/bevel-spy sets to lcm-spy's.
 */
public final class PathPlugin implements SpyPlugin {
  private static final String NAME = "Path and target";
  private static final String[] CHANNELS = {"NEEDLE_STATE", "NEEDLE_TRUTH", "TIP_MEASUREMENT", "STEERING_TARGET"};
  private static final int REPAINT_MS = 50;

  // lcm-spy looks for plug-ins along CLASSPATH and along java's own path, and makes one of each find: one is enough.
  private static final AtomicBoolean MADE = new AtomicBoolean();
  private final boolean first = MADE.compareAndSet(false, true);

  @Override
  public boolean canHandle(long fingerprint) {
    return first && (fingerprint == needle_state_t.LCM_FINGERPRINT || fingerprint == steering_target_t.LCM_FINGERPRINT
        || fingerprint == tip_measurement_t.LCM_FINGERPRINT);
  }

  /** lcm-spy asks with nulls first, for the name alone. */
  @Override
  public Action getAction(JDesktopPane desktop, ChannelData channel) {
    return new AbstractAction(NAME) {
      private static final long serialVersionUID = 1;

      @Override
      public void actionPerformed(ActionEvent event) {
        open(desktop);
      }
    };
  }

  /** Gives a message to the picture; one that cannot be decoded is lcm-spy's to show. */
  static LCMSubscriber subscriberOf(PathView view) {
    return (lcm, channel, bytes) -> {
      try {
        deliver(view, channel, bytes);
      } catch (IOException | RuntimeException damaged) {
        // No exception may leave a handler: LCM's thread would end.
      }
    };
  }

  private static void deliver(PathView view, String channel, LCMDataInputStream bytes) throws IOException {
    if (channel.equals("NEEDLE_STATE")) {
      view.onEstimate(new needle_state_t(bytes));
    } else if (channel.equals("NEEDLE_TRUTH")) {
      view.onTruth(new needle_state_t(bytes));
    } else if (channel.equals("TIP_MEASUREMENT")) {
      view.onMeasurement(new tip_measurement_t(bytes));
    } else if (channel.equals("STEERING_TARGET")) {
      view.onTarget(new steering_target_t(bytes));
    }
  }

  private static void open(JDesktopPane desktop) {
    PathView view = new PathView();
    LCMSubscriber subscriber = subscriberOf(view);
    for (String channel : CHANNELS) {
      LCM.getSingleton().subscribe(channel, subscriber);
    }
    Timer repaint = new Timer(REPAINT_MS, event -> view.repaint());
    JInternalFrame frame = new JInternalFrame(NAME, true, true, true, true);
    frame.addInternalFrameListener(new InternalFrameAdapter() {
      @Override
      public void internalFrameClosed(InternalFrameEvent event) {
        repaint.stop();
        for (String channel : CHANNELS) {
          LCM.getSingleton().unsubscribe(channel, subscriber);
        }
      }
    });
    frame.add(view);
    frame.pack();
    desktop.add(frame);
    frame.setVisible(true);
    java.awt.Window window = SwingUtilities.getWindowAncestor(desktop);
    if (window != null) {  // lcm-spy's own is smaller than the picture
      window.setSize(frame.getWidth() + 40, frame.getHeight() + 70);
    }
    repaint.start();
  }
}
