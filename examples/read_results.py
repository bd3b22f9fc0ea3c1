"""
Results of a finished run, with h5py and matplotlib only
========================================================

Who gets a results file needs no circuittex to read it: groups are named after states, and every dataset says what it
is and in which unit.
"""

import h5py
import matplotlib.pyplot as plt
import numpy as np

import circuittex as ct

# %%
# First a finished run; all that follows does without circuittex.

loading = (ct.uniaxial("stretch", (0.05,)),)
ct.run_study(ct.plain_weave("paper-code", yarns=2, rows=(1, 2), loading=loading), "results_to_read")

# %%
# What is in the file says itself what it means.

with h5py.File("results_to_read/results.h5") as file:
    print("states:", ", ".join(file["states"]))
    contacts = file["states/relaxed/contacts"]
    for name in ("line_load", "gap"):
        print(f"{name} [{contacts[name].attrs['unit']}]: {contacts[name].attrs['description']}")
    loads = {state: file[f"states/{state}/contacts/line_load"][()] for state in file["states"]}
    force = file["states/relaxed/clamp_force"][()]

print(f"clamp force of the warp at rest {force[0, 0]:.4f} N")

# %%

figure, axes = plt.subplots(layout="constrained")
for state, load in loads.items():
    axes.hist(load, bins=np.linspace(0.0, max(map(np.max, loads.values())), 30), histtype="step", label=state)
axes.set(xlabel="line load of a contact point, N/mm", ylabel="contact points")
axes.legend()
