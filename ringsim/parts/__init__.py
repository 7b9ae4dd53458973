"""What a scene is made of: frozen, validated records; numpy only, no engine."""
