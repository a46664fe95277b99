"""Loading and unloading of a sticky rough surface: energy is lost in jumps, and the loss has parts."""

import icha

spectrum = icha.SelfAffineSpectrum(100e-6, 50e-6, 25e-6, hurst=0.8, rms_slope=0.1)
surface = spectrum.realise(grid=64, seed=2)
silicone = icha.Material(contact_modulus=2e6, surface_energy=2e-3)
path = icha.Path(reduced_pressures=[5e-3, 2e-2], unload=True)
run = icha.simulate(surface, silicone, path, model="boundary_elements")

loss = float(run.hysteresis_loss)
parts = {name: float(run[name]) for name in run if str(name).startswith(("loss_by_", "loss_unattributed"))}
for name, part in parts.items():
    print(f"{name}: {part:.3g} J/m^2")
print(f"pull-off at {float(run.pull_off_pressure):.3g} Pa, loss {loss:.3g} J/m^2")
ratio = sum(parts.values()) / loss
print(f"sum of the parts: {ratio:.6f} times the loss")
