// The last seconds of what the arm pushes and what it feels, live.
import { useSignalEffect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import UPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import type { DrillSession } from "../state/drill_session";
import { kShown_s } from "../state/force_trace";

/** Drawing more often than this takes time from the drill. */
const kRedraw_ms = 50;
const kHeight_px = 118;
export const kPushColour = "#f2a541";
export const kFeltColour = "#35c3d6";

export function ForceChart({ session }: { session: DrillSession }) {
  const box = useRef<HTMLDivElement>(null);
  const plot = useRef<UPlot | null>(null);
  const due = useRef(0);
  useEffect(() => {
    const place = box.current!;
    const made = new UPlot(optionsFor(session, place.clientWidth), session.forces.columns(), place);
    plot.current = made;
    const watch = new ResizeObserver(() => made.setSize({ width: place.clientWidth, height: kHeight_px }));
    watch.observe(place);
    return () => {
      watch.disconnect();
      clearTimeout(due.current);
      made.destroy();
      plot.current = null;
    };
  }, [session]);
  useSignalEffect(() => {
    if (session.trace_version.value === 0 || due.current !== 0) return;
    due.current = setTimeout(() => {
      due.current = 0;
      plot.current?.setData(session.forces.columns());
    }, kRedraw_ms) as unknown as number;
  });
  return (
    <figure class="force-chart">
      <figcaption>
        <span class="legend legend-push">Push</span>
        <span class="legend legend-felt">Force felt</span>
        <span class="dim">N, last {kShown_s} s</span>
      </figcaption>
      <div ref={box} role="img" aria-label="Push and force felt over the last seconds" />
    </figure>
  );
}

function optionsFor(session: DrillSession, width: number): UPlot.Options {
  const axis = { stroke: "#9aa7b3", font: "11px 'Inter Variable', system-ui, sans-serif" };
  const grid = { stroke: "#222c35", width: 1 };
  const line = (stroke: string, dash?: number[]): UPlot.Series => ({
    stroke,
    width: 1.5,
    points: { show: false },
    ...(dash ? { dash } : {}),
  });
  return {
    width,
    height: kHeight_px,
    pxAlign: false,
    legend: { show: false },
    cursor: { show: false },
    padding: [6, 16, 0, 0],
    scales: {
      x: { time: false, range: () => [session.forces.end_s - kShown_s, session.forces.end_s] },
      y: { range: (_plot, low, high) => [Math.min(0, low ?? 0), Math.max(10, (high ?? 0) * 1.05)] },
    },
    axes: [
      {
        ...axis,
        grid: { show: false },
        ticks: { show: false },
        size: 18,
        gap: 2,
        // Seconds before now: the clock itself says nothing.
        splits: () => [8, 6, 4, 2, 0].map((ago) => session.forces.end_s - ago),
        values: (_plot, splits) =>
          splits.map((t) =>
            t > session.forces.end_s - 0.05 ? "now" : `${Math.round(t - session.forces.end_s)} s`,
          ),
      },
      { ...axis, grid, ticks: { show: false }, size: 34, gap: 4, space: 26 },
    ],
    series: [{}, line(kPushColour, [5, 3]), line(kFeltColour)],
  };
}
