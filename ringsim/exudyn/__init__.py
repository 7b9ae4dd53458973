"""The only room that knows exudyn: builds the model of a scene and integrates it."""
