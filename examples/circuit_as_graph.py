"""
The circuit as a graph: which fibrils carry the current?
========================================================

The detailed circuit has a node at every fibril end and contact foot. As a networkx graph it can be asked anything
that networkx answers.
"""

from collections import defaultdict

import matplotlib.pyplot as plt
import networkx as nx

import circuittex as ct

# %%
# The circuit between the ends of two parallel yarns, which are joined by contacts alone.

design = ct.plain_weave("paper-code", yarns=2)
mesh = ct.build_mesh(design)
contacts = ct.contacts_of(design, mesh, ct.relax(mesh, design).configuration)
ends = [terminal for terminal in design.terminals if terminal.name in ("parallel", "common")]
circuit = ct.build_circuit(contacts, ends)
graph = ct.to_networkx(circuit)
parts = nx.number_connected_components(graph)
print(f"{graph.number_of_nodes()} nodes, {graph.number_of_edges()} resistors, {parts} part")

# %%
# Node voltages by nodal analysis give the current of every resistor; a segment is named after its fibril.

voltage = dict(zip(circuit.node_names, ct.solve_nodal(circuit, {"parallel": 1.0, "common": 0.0}).voltage, strict=True))
carried: dict[str, float] = defaultdict(float)
for one, other, name, resistor in graph.edges(keys=True, data=True):
    if resistor["kind"] == "segment":
        fibril = "_".join(name.split("_")[1:3])
        carried[fibril] = max(carried[fibril], abs(voltage[one] - voltage[other]) / resistor["resistance"])

ranking = sorted(carried, key=carried.__getitem__, reverse=True)
print("most current:", ", ".join(f"{fibril} {1e3 * carried[fibril]:.2f} mA" for fibril in ranking[:3]))

# %%
# The least resistance between the terminals is a shortest path: it leaves one yarn, crosses the weft, and ends in
# the other.

source, sink = (circuit.node_names[node] for node in circuit.port_node)
easiest = nx.shortest_path(nx.Graph(graph), source, sink, weight="resistance")
print("easiest way through", " -> ".join(dict.fromkeys("_".join(node.split("_")[:2]) for node in easiest[1:-1])))

# %%

figure, axes = plt.subplots(figsize=(8, 3.6), layout="constrained")
axes.bar(ranking, [1e3 * carried[fibril] for fibril in ranking])
axes.set(ylabel="largest current in the fibril, mA")
axes.tick_params(axis="x", rotation=90, labelsize=6)
