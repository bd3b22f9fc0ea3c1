"""The frame of report.html, filled by `circuittex.results.report.page`."""

from __future__ import annotations

PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title - circuittex</title>
<style>
body { margin: 0 auto; max-width: 62rem; padding: 1rem; font: 16px/1.5 system-ui, sans-serif; color: #1b1b1b;
  background: #fff; }
h1 { line-height: 1.2; overflow-wrap: anywhere; }
h2 { margin-top: 2.2rem; border-bottom: 1px solid #ccc; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .1rem 1rem; }
dt { font-weight: 600; }
dd { margin: 0; overflow-wrap: anywhere; }
figure { margin: 1.2rem 0; }
figure img { display: block; max-width: 100%; height: auto; margin: 0 auto; }
figcaption { color: #444; font-size: .9rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .88rem; font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .7rem; text-align: right; border-bottom: 1px solid #ddd; }
thead th { border-bottom: 2px solid #888; vertical-align: bottom; }
th:first-child { text-align: left; }
tbody th { font-weight: 500; white-space: nowrap; }
.good, .bad { margin: .8rem 0; padding: .2rem 1rem; border-left: .4rem solid #009e73; background: #eef8f4; }
.bad { border-color: #d55e00; background: #fdf1e8; font-weight: 600; }
.numbers td { white-space: nowrap; }
.numbers th, .numbers td { padding: .25rem .5rem; }
.claims th, .claims td { text-align: left; vertical-align: top; min-width: 11rem; }
.claims tbody th { white-space: normal; min-width: 19rem; }
.claims small { display: block; margin-top: .25rem; font-weight: 400; color: #555; }
em { display: inline-block; margin-right: .3rem; padding: 0 .4rem; border-radius: .3rem; font-style: normal;
  font-weight: 600; background: #eee; }
em.yes { background: #d5efe5; }
em.partly { background: #fdf0c8; }
em.no { background: #f9d9c3; }
footer { margin-top: 3rem; color: #555; font-size: .85rem; }
@media print {
  body { max-width: none; font-size: 9pt; padding: 0; }
  figure, tr { break-inside: avoid; }
  .scroll { overflow: visible; }
  th, td { padding: .15rem .3rem; }
}
</style>
</head>
<body>
<h1>$title</h1>
$facts
$verdict
$alarm
<h2>The cell</h2>
$figure_cell
$figure_section
<h2>Recorded states</h2>
$states
$figure_forces
$figure_strained
$figure_probes
<h2>Fields</h2>
$figure_currents
$figure_temperatures
<h2>Reduced network</h2>
<p>Each crossing of the weave is four arms of Ry/2 and one contact resistance Rc; Ry and Rc are fitted to the probe
currents of each state.</p>
$figure_network
$network
$branches
$errors
$claims
<h2>Verification</h2>
<p>Finite elements, a nodal solution of the netlist's circuit and ngspice solve the same network independently of one
another. Merging is the relative change of a probe current by merging neighbouring contact points for the netlist; the
mechanical mesh is the relative difference when voltages are solved on the mesh of the mechanics. The time is that of
all routes.</p>
$figure_verification
$figure_convergence
$verification
<h2>Parameters</h2>
<p>Base units: mm, N, MPa, g, S, W, K, V.</p>
$parameters
<footer>Written by circuittex $version. The numbers are also in summary.json, and everything is in the HDF5 file beside
this page.</footer>
</body>
</html>
"""
